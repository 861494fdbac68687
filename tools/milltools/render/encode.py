"""Makes films from pictures with ffmpeg, and reads the properties of a film with ffprobe.

ffmpeg gets raw pictures on its standard input.
"""

import contextlib
import errno
import fractions
import json
import os
import subprocess
import tempfile

import numpy as np

from milltools.base import extras, processes
from milltools.base.errors import UserError
from milltools.base.files import opened, whole

# converts the colours to the standard of HD video (BT.709), and records that in the file
COLOURS = [
    "-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int", "-pix_fmt", "yuv420p",
    "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv",
]  # fmt: skip
PALETTE = "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle"
# a fixed number of threads, because the output of x264 and libvpx depends on it: films must not depend on the machine
FORMATS = {
    ".mp4": ["-c:v", "libx264", "-preset", "medium", "-crf", "20", "-threads", "4", *COLOURS,
             "-movflags", "+faststart", "-f", "mp4"],
    ".webm": ["-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "33", "-row-mt", "1", "-cpu-used", "4", "-threads", "4",
              *COLOURS, "-f", "webm"],
    # formats that pages show without a player; they repeat
    ".webp": ["-c:v", "libwebp_anim", "-pix_fmt", "yuv420p", "-quality", "60", "-compression_level", "5", "-loop", "0",
              "-f", "webp"],
    ".gif": ["-filter_complex", PALETTE, "-loop", "0", "-f", "gif"],
}  # fmt: skip
NO_ROOM = errno.ENOSPC, errno.EDQUOT, errno.EFBIG


def program(name="ffmpeg") -> str:
    """Path of ffmpeg or ffprobe; UserError if it is not installed."""
    return extras.program(name, "ffmpeg")


@contextlib.contextmanager
def ffmpeg(path, *words, **streams):
    """The process of an ffmpeg command. UserError about `path` if ffmpeg fails, at its end or while it gets data."""
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [*processes.guard(), program(), "-v", "error", "-nostdin", *words],
            stderr=said,
            start_new_session=True,  # this process handles Ctrl-C
            restore_signals=False,  # ffmpeg must report that it cannot write, not be killed by a signal
            **streams,
        )
        try:
            try:
                yield process
                if process.stdin:
                    process.stdin.close()
            except BrokenPipeError:
                process.wait()
                raise _fault(path, process, said) from None
            if process.wait() != 0:
                raise _fault(path, process, said)
        finally:
            process.kill()
            process.wait()
            for stream in filter(None, (process.stdin, process.stdout)):
                with contextlib.suppress(BrokenPipeError):
                    stream.close()


@contextlib.contextmanager
def encoder(path, size, fps):
    """Yields a function that adds a picture, uint8 (height, width, 3), top row first, to the film, which is at `path`
    afterwards.

    path: its suffix is one of FORMATS; size (width, height) [pixels], both even; fps [1/s]."""
    width, height = size
    rate = str(fractions.Fraction(fps).limit_denominator(100_000))  # exactly: '25', '30000/1001'
    words = [
        "-xerror", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", rate, "-i", "pipe:0",
        "-an", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1", *FORMATS[path.suffix.lower()],
    ]  # fmt: skip
    streams = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL}
    with whole(path) as draft, ffmpeg(path, *words, f"file:{draft}", **streams) as process:

        def add(picture):
            process.stdin.write(np.ascontiguousarray(picture).data)

        yield add


def _fault(path, process, said):
    said.seek(0)
    text = said.read().decode(errors="replace")
    for reason in map(os.strerror, NO_ROOM):
        if reason in text:
            return UserError(f"{path}: {reason}", status=1)
    lines = text.strip().splitlines() or [f"it ended with status {process.returncode}"]
    return UserError(f"{path}: ffmpeg: {lines[0]}", status=1)


def probe(path) -> tuple[int, int, float, int | None]:
    """Width and height [pixels], rate [1/s] and number of pictures (None: not known) of the first video of a file, from
    ffprobe."""
    opened(path, "a film").close()
    words = [program("ffprobe"), *"-v error -select_streams v:0 -show_streams -of json".split(), f"file:{path}"]
    done = subprocess.run(words, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)
    try:
        stream = json.loads(done.stdout)["streams"][0]
        width, height, rate = (
            int(stream["width"]),
            int(stream["height"]),
            float(fractions.Fraction(stream["r_frame_rate"])),
        )
        count = int(stream["nb_frames"]) if stream.get("nb_frames", "").isdigit() else None
        if not (rate > 0 and width > 0 and height > 0):
            raise ValueError
    except (ValueError, KeyError, IndexError, TypeError, ZeroDivisionError):
        raise UserError(f"{path}: ffmpeg finds no video in it") from None
    return width, height, rate, count
