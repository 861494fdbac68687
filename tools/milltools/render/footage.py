"""Joins the film of a camera with pictures of the simulation at the same times.

Picture k of the camera was taken at the time offset + k / (pictures per second) of the run. Files of high-speed cameras
play slowly, so the rate at which the pictures were taken differs from the rate at which the file plays.
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
    """A camera's film: `path`, the `crop` to show (width, height, and x, y of its upper left corner) [pixels], the
    `rate` at which it plays [1/s], and its number of `pictures` if the file contains it."""

    path: str
    crop: tuple[int, int, int, int]
    rate: float
    pictures: int | None

    def width(self, height) -> int:
        """The width of its pictures scaled to `height` pixels; even, as films require."""
        return max(2, 2 * round(self.crop[0] * height / self.crop[1] / 2))


def open_film(path, crop=None) -> Film:
    """The film at a path, or the part "WxH+X+Y" of its pictures. UserError if there is no such film or part."""
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
    # every picture of the file exactly once, whatever its time stamp
    words = [
        "-i", f"file:{film.path}", "-map", "0:v:0", "-vf", chain, "-vsync", "passthrough",
        "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1",
    ]  # fmt: skip
    size = width * height * 3
    with encode.ffmpeg(film.path, *words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as process:
        while len(content := process.stdout.read(size)) == size:
            yield np.frombuffer(content, np.uint8).reshape(height, width, 3)


def beside(mine, height, film, skip):
    """Yields each picture of the simulation (`mine`, `height` pixels high) joined with the next one of the film, from
    number `skip` on; ends with the shorter of the two. Labels name the two parts."""
    labels = [_label(name, height) for name in ("simulation", "camera")]
    gap = np.full((height, GAP, 3), GROUND, np.uint8)
    with contextlib.closing(pictures(film, height, skip)) as theirs:
        for left, right in zip(mine, theirs):
            joined = np.concatenate([left, gap, right], axis=1)
            for label, end in zip(labels, (left.shape[1], joined.shape[1])):
                rows, columns = label.shape[:2]
                begin = max(0, end - columns)  # in the upper right corner, which is free in pictures of the scene
                joined[:rows, begin:end] = label[:, columns - (end - begin) :]
            yield joined


def _label(text, height):
    pixels = max(12, round(height / 32))
    shape = font(pixels)
    box = shape.getbbox(text)
    image = Image.new("RGB", (box[2] + pixels, round(1.6 * pixels)), GROUND)
    ImageDraw.Draw(image).text((pixels / 2, 0.8 * pixels), text, fill=INK, font=shape, anchor="lm")
    return np.array(image)
