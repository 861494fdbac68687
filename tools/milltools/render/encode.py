"""Pictures into a film, by ffmpeg; and what its sibling ffprobe says of one.

ffmpeg gets raw pictures on its standard input and writes beside the film's name; the name is given to a whole film only.
"""

import fractions
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

from milltools.base import processes
from milltools.base.errors import UserError

# screens' red, green and blue as the video standard of HD has them, said so in the file
COLOURS = [
    "-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int", "-pix_fmt", "yuv420p",
    "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv",
]  # fmt: skip
PALETTE = "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle"  # fmt: skip
# a fixed number of threads: x264's and libvpx's output depends on it, and films of one run are to be the same anywhere
FORMATS = {
    ".mp4": ["-c:v", "libx264", "-preset", "medium", "-crf", "20", "-threads", "4", *COLOURS,
             "-movflags", "+faststart", "-f", "mp4"],
    ".webm": ["-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "33", "-row-mt", "1", "-cpu-used", "4", "-threads", "4",
              *COLOURS, "-f", "webm"],
    # pictures that move in a page without a player, over and over
    ".webp": ["-c:v", "libwebp_anim", "-pix_fmt", "yuv420p", "-quality", "60", "-compression_level", "5", "-loop", "0",
              "-f", "webp"],
    ".gif": ["-filter_complex", PALETTE, "-loop", "0", "-f", "gif"],
}  # fmt: skip
NO_ROOM = "No space left on device"


def program(name="ffmpeg") -> str:
    """Path of ffmpeg or ffprobe; UserError if it is not installed."""
    found = shutil.which(name)
    if not found:
        raise UserError(f"{name} is not installed: films need it: sudo apt-get install ffmpeg", status=1)  # fmt: skip
    return found


def rate(fps) -> str:
    """A frame rate [1/s] as ffmpeg takes it, exactly: '25', '30000/1001'."""
    return str(fractions.Fraction(fps).limit_denominator(100_000))


class Encoder:
    """A film being written; a context manager. Leaving it without an exception completes the film."""

    def __init__(self, path, size, fps):
        """path: its suffix is one of FORMATS; size (width, height) [pixels], both even; fps [1/s]."""
        self.path = pathlib.Path(path)
        self.size, self.fps = size, fps
        self.draft = self.path.with_name(f"{self.path.name}.part")
        self._process = self._said = None

    def __enter__(self):
        width, height = self.size
        self._said = tempfile.TemporaryFile()
        command = [
            *processes.guard(), program(), "-v", "error", "-nostdin", "-xerror", "-y",
            "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", rate(self.fps), "-i", "pipe:0",
            "-an", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1",
            *FORMATS[self.path.suffix.lower()], f"file:{self.draft}",
        ]  # fmt: skip
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            start_new_session=True,  # Ctrl-C is ours to handle
        )
        return self

    def write(self, picture):
        """One more picture: uint8 (height, width, 3), top row first."""
        width, height = self.size
        if picture.shape != (height, width, 3) or picture.dtype != "uint8":
            raise ValueError(f"expected {width} x {height} pictures, got {picture.shape}")
        try:
            self._process.stdin.write(picture.data if picture.flags.c_contiguous else picture.tobytes())  # fmt: skip
        except BrokenPipeError:
            self._process.wait()
            raise self._fault() from None

    def __exit__(self, kind, *_):
        try:
            if kind is None:
                self._finish()
        finally:
            if self._process.poll() is None:
                self._process.kill()
                self._process.wait()
            self._said.close()
            self.draft.unlink(missing_ok=True)

    def _finish(self):
        try:
            self._process.stdin.close()
        except BrokenPipeError:
            pass  # its status tells more
        if self._process.wait() != 0:
            raise self._fault()
        try:
            os.replace(self.draft, self.path)
        except OSError as fault:
            raise UserError(f"{self.path}: {fault.strerror}", status=1) from None

    def _fault(self):
        self._said.seek(0)
        text = self._said.read().decode(errors="replace")
        if NO_ROOM in text:
            return UserError(f"{self.path}: {NO_ROOM}", status=1)
        lines = text.strip().splitlines()
        last = lines[0] if lines else f"it ended with status {self._process.returncode}"
        return UserError(f"{self.path}: ffmpeg: {last}", status=1)


def probe(path) -> dict:
    """What ffprobe says of the first video stream of a file: width, height, rate [1/s], pictures (or None)."""
    try:
        with open(path, "rb"):
            pass
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror}") from None
    words = [program("ffprobe"), "-v", "error", "-select_streams", "v:0", "-show_streams", "-of", "json", f"file:{path}"]  # fmt: skip
    done = subprocess.run(words, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)  # fmt: skip
    try:
        stream = json.loads(done.stdout)["streams"][0]
        found = {
            "width": int(stream["width"]),
            "height": int(stream["height"]),
            "rate": float(fractions.Fraction(stream["r_frame_rate"])),
            "pictures": int(stream["nb_frames"]) if stream.get("nb_frames", "").isdigit() else None,
        }
    except (ValueError, KeyError, IndexError, TypeError, ZeroDivisionError):
        raise UserError(f"{path}: ffmpeg finds no video in it") from None
    if not (found["rate"] > 0 and found["width"] > 0 and found["height"] > 0):
        raise UserError(f"{path}: ffmpeg finds no video in it")
    return found
