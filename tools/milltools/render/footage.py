"""A camera's film beside the simulation, picture by picture in step.

Picture k of the camera was taken at offset + k / (its frames a second) of the run's time. High-speed cameras write files that play slowly,
so the rate at which pictures were taken and the rate at which the file plays are two things.
"""

import contextlib
import dataclasses
import re
import subprocess
import tempfile

import numpy as np
from PIL import Image, ImageDraw

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.render import encode
from milltools.render.overlay import font

GAP = 4  # pixels between the two
INK, GROUND = (255, 255, 255), (38, 46, 58)


@dataclasses.dataclass(frozen=True)
class Crop:
    """A part of a picture [pixels]: its size, and where its upper left corner is."""

    width: int
    height: int
    x: int = 0
    y: int = 0


@dataclasses.dataclass(frozen=True)
class Film:
    """A camera's film: `path`, the `crop` that is shown, frames a second it plays at, and how many pictures it says it has."""

    path: str
    crop: Crop
    rate: float
    pictures: int | None

    def width(self, height) -> int:
        """Its width when it is `height` pixels high; even, as films want it."""
        return max(2, 2 * round(self.crop.width * height / self.crop.height / 2))


def open_film(path, crop=None) -> Film:
    """The film at a path, or the part "WxH+X+Y" of its pictures. UserError where there is none."""
    found = encode.probe(path)
    whole = found["width"], found["height"]
    part = Crop(*whole) if crop is None else _crop(crop, path, whole)
    return Film(str(path), part, found["rate"], found["pictures"])


def _crop(text, path, whole):
    match = re.fullmatch(r"(\d+)x(\d+)(?:\+(\d+)\+(\d+))?", text)
    if not match:
        raise UserError(f"--crop: expected WxH+X+Y in pixels, such as 640x480+20+10, got '{text}'")
    part = Crop(*(int(number or 0) for number in match.groups()))
    least = min(part.width, part.height)
    if least < 2 or part.x + part.width > whole[0] or part.y + part.height > whole[1]:
        raise UserError(f"--crop: {text} is not within {path}, {whole[0]}x{whole[1]} pixels")
    return part


def pictures(film, height, skip=0):
    """Yields the film's pictures from number `skip` on, uint8 (height, film.width(height), 3)."""
    width, crop = film.width(height), film.crop
    chain = (
        f"select=gte(n\\,{skip}),crop={crop.width}:{crop.height}:{crop.x}:{crop.y}:exact=1,"
        f"scale={width}:{height}:flags=lanczos+accurate_rnd+full_chroma_int"
    )
    # every picture as it is in the file, whatever its time stamp
    command = [
        *processes.guard(), encode.program(), "-v", "error", "-nostdin", "-i", f"file:{film.path}", "-map", "0:v:0", "-vf", chain,
        "-vsync", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1",
    ]  # fmt: skip
    size = width * height * 3
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=said, start_new_session=True
        )
        try:
            while len(content := process.stdout.read(size)) == size:
                yield np.frombuffer(content, np.uint8).reshape(height, width, 3)
            if process.wait() != 0:
                said.seek(0)
                lines = said.read().decode(errors="replace").strip().splitlines() or ["it failed"]
                raise UserError(f"{film.path}: ffmpeg: {lines[0]}", status=1)
        finally:
            process.stdout.close()
            if process.poll() is None:
                process.kill()
            process.wait()


def size(ours, film) -> tuple[int, int]:
    """Size of the film of both beside each other."""
    return ours[0] + GAP + film.width(ours[1]), ours[1]


def beside(ours, film, skip):
    """A function of the simulation's pictures, of size `ours`, that gives each joined with the film's next one, from number `skip`
    on; it ends when either does. On both stands what they are."""
    height = ours[1]
    labels = [_label(name, height) for name in ("simulation", "camera")]
    gap = np.full((height, GAP, 3), GROUND, np.uint8)

    def join(mine):
        theirs = pictures(film, height, skip)
        with contextlib.closing(theirs):
            for left, right in zip(mine, theirs):
                joined = np.concatenate([left, gap, right], axis=1)
                for label, end in zip(labels, (left.shape[1], joined.shape[1])):
                    rows, columns = label.shape[:2]
                    begin = max(0, end - columns)  # the upper right corner: the scene writes nothing there
                    joined[:rows, begin:end] = label[:, columns - (end - begin) :]
                yield joined

    return join


def _label(text, height):
    pixels = max(12, round(height / 32))
    shape = font(pixels)
    box = shape.getbbox(text)
    image = Image.new("RGB", (box[2] + pixels, round(1.6 * pixels)), GROUND)
    ImageDraw.Draw(image).text((pixels / 2, 0.8 * pixels), text, fill=INK, font=shape, anchor="lm")
    return np.array(image)
