"""What the tests of mill render share: runs of a small mill, a camera's film, films read back."""

import json
import os
import subprocess
import sys

import numpy as np
from conftest import PROGRAM, ROOT, SMALL
from PIL import Image

MILL = (sys.executable, "-m", "milltools")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM)}
SMALLEST = ("--size", "160x120", "--quality", "draft", "--limits", "0,3", "--workers", "1")
STEP = 0.4e-3  # [s] between pictures at --slow 100 and 25 a second


def make_runs(folder):
    """The small mill run four ways: run.h5, fine.h5 with a frame every STEP, log.h5 with all impacts, none.h5
    without frames."""
    (folder / "deck.ini").write_text(SMALL)
    for name, change in (
        ("run", "output.frames=5 ms"),
        ("fine", f"output.frames={STEP!r} s"),
        ("log", "output.impacts=all"),
        ("none", "output.frames=0 s"),
    ):
        words = ["-q", "-o", f"{name}.h5", "-s", change, "deck.ini"]
        subprocess.run([PROGRAM, *words], cwd=folder, check=True, capture_output=True)
    return folder


def make_camera(path):
    """A film of 64x48 pixels, 20 pictures at 25 a second, picture k as bright as 10 k in the middle, with a bright
    edge."""
    k = np.arange(20)[:, None, None, None]
    shots = np.broadcast_to(10 * k, (20, 48, 64, 3)).astype(np.uint8).copy()
    shots[:, :, :8] = shots[:, :, -8:] = shots[:, :8] = shots[:, -8:] = 255
    words = "ffmpeg -v error -f rawvideo -pix_fmt rgb24 -s 64x48 -r 25 -i - -pix_fmt yuv420p -crf 1"
    subprocess.run([*words.split(), path], input=shots.tobytes(), check=True)
    return path


def probe(path):
    """(codec, pixel format, width, height, pictures counted, duration [s]) of a film that decodes without a word."""
    fields = "codec_name,pix_fmt,width,height,nb_read_frames:format=duration"
    words = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", f"stream={fields}", "-of", "json", path]
    found = json.loads(subprocess.run(words, capture_output=True, check=True).stdout)
    decoded = subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-f", "null", "-"], capture_output=True)  # fmt: skip
    assert (decoded.returncode, decoded.stdout, decoded.stderr) == (0, b"", b"")
    stream = found["streams"][0]
    names = ("codec_name", "pix_fmt", "width", "height")
    return (*(stream[name] for name in names), int(stream["nb_read_frames"]), float(found["format"]["duration"]))


def frames(path):
    """All pictures of a film, float (n, h, w, 3)."""
    _, _, width, height, count, _ = probe(path)
    words = ["ffmpeg", "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(words, capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(count, height, width, 3).astype(float)


def picture(path):
    with Image.open(path) as image:
        return np.array(image.convert("RGB")).astype(float)


def off(one, two):
    """Mean difference of two pictures."""
    return np.abs(one - two).mean()
