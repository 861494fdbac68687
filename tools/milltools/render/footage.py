"""A camera's film beside the simulation, picture by picture in step.

Picture k of the camera was taken at offset + k / (its frames a second) of the run's time. High-speed cameras write
files that play slowly, so the rate at which pictures were taken and the rate at which the file plays are two things.
"""

import contextlib
import dataclasses
import re
import subprocess

import numpy as np
from PIL import Image, ImageDraw

from milltools.base.errors import UserError
from milltools.render import encode
from milltools.render.overlay import font

GAP = 4  # pixels between the two
INK, GROUND = (255, 255, 255), (38, 46, 58)


@dataclasses.dataclass(frozen=True)
class Film:
    """A camera's film: `path`, the `crop` that is shown (width, height, and x, y of its upper left corner) [pixels],
    frames a second it plays at, and how many pictures it says it has."""

    path: str
    crop: tuple[int, int, int, int]
    rate: float
    pictures: int | None

    def width(self, height) -> int:
        """Its width when it is `height` pixels high; even, as films want it."""
        return max(2, 2 * round(self.crop[0] * height / self.crop[1] / 2))


def open_film(path, crop=None) -> Film:
    """The film at a path, or the part "WxH+X+Y" of its pictures. UserError where there is none."""
    width, height, rate, count = encode.probe(path)
    part = (width, height, 0, 0)
    if crop is not None:
        match = re.fullmatch(r"(\d+)x(\d+)(?:\+(\d+)\+(\d+))?", crop)
        if not match:
            raise UserError(f"--crop: expected WxH+X+Y in pixels, such as 640x480+20+10, got '{crop}'")
        part = tuple(int(number or 0) for number in match.groups())
        if min(part[:2]) < 2 or part[2] + part[0] > width or part[3] + part[1] > height:
            raise UserError(f"--crop: {crop} is not within {path}, {width}x{height} pixels")
    return Film(str(path), part, rate, count)


def pictures(film, height, skip=0):
    """Yields the film's pictures from number `skip` on, uint8 (height, film.width(height), 3)."""
    width = film.width(height)
    chain = (
        f"select=gte(n\\,{skip}),crop={':'.join(map(str, film.crop))}:exact=1,"
        f"scale={width}:{height}:flags=lanczos+accurate_rnd+full_chroma_int"
    )
    # every picture as it is in the file, whatever its time stamp
    words = [
        "-i", f"file:{film.path}", "-map", "0:v:0", "-vf", chain, "-vsync", "passthrough",
        "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1",
    ]  # fmt: skip
    size = width * height * 3
    with encode.ffmpeg(film.path, *words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as process:
        while len(content := process.stdout.read(size)) == size:
            yield np.frombuffer(content, np.uint8).reshape(height, width, 3)


def beside(mine, height, film, skip):
    """Yields each of the simulation's pictures `mine`, `height` pixels high, joined with the film's next one, from
    number `skip` on; ends when either does. On both stands what they are."""
    labels = [_label(name, height) for name in ("simulation", "camera")]
    gap = np.full((height, GAP, 3), GROUND, np.uint8)
    with contextlib.closing(pictures(film, height, skip)) as theirs:
        for left, right in zip(mine, theirs):
            joined = np.concatenate([left, gap, right], axis=1)
            for label, end in zip(labels, (left.shape[1], joined.shape[1])):
                rows, columns = label.shape[:2]
                begin = max(0, end - columns)  # the upper right corner: the scene writes nothing there
                joined[:rows, begin:end] = label[:, columns - (end - begin) :]
            yield joined


def _label(text, height):
    pixels = max(12, round(height / 32))
    shape = font(pixels)
    box = shape.getbbox(text)
    image = Image.new("RGB", (box[2] + pixels, round(1.6 * pixels)), GROUND)
    ImageDraw.Draw(image).text((pixels / 2, 0.8 * pixels), text, fill=INK, font=shape, anchor="lm")
    return np.array(image)
