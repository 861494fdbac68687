"""Text over a picture: the colour bar, drawn once, and the time, drawn for every frame.

Sizes are proportional to the shorter side of the picture. A wide picture has the bar on the right, a narrow one below.
"""

import functools
import pathlib

import matplotlib
import numpy as np
from matplotlib.ticker import MaxNLocator
from PIL import Image, ImageDraw, ImageFont

from milltools.render.colour import TABLES

WIDE = 1.4  # for this or a larger ratio of width to height, the bar is on the right
INK = (38, 46, 58)


@functools.cache
def font(pixels: int) -> ImageFont.FreeTypeFont:
    """The font of matplotlib, which is on every machine and has all characters needed."""
    path = pathlib.Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(path, pixels)


class Overlay:
    """The bar of a colour.Colour and the lines of text of a picture of `size` pixels."""

    def __init__(self, size, colour, caption="", span=1.0):
        self.size, self.colour, self.caption = size, colour, caption
        self.milliseconds = span < 10
        self.unit = max(1.0, min(size) / 100)
        self.wide = size[0] >= WIDE * size[1]
        self._bar = self._draw_bar()

    @property
    def frame(self):
        """The part left for the mill (left, top, right, bottom), in shares of the picture."""
        width, height = self.size
        gap = 2.2 * self.unit
        if self.wide:
            taken = (self._bar[1].size[0] + 2 * gap) / width
            return gap / width, gap / height, 1 - taken, 1 - gap / height
        top, taken = 12 * self.unit / height, (self._bar[1].size[1] + 2 * gap) / height
        return gap / width, top, 1 - gap / width, 1 - taken

    def paste(self, picture, time):
        """Writes over `picture` (h, w, 3) uint8 in place; `time` in s."""
        at, bar = self._bar
        _blend(picture, bar, at)
        text = f"t = {time * 1e3:.2f} ms" if self.milliseconds else f"t = {time:.4f} s"
        _blend(picture, self._line(text, 3.4), (2.6, 2.0), self.unit)
        for number, image in enumerate(self._caption_images):
            _blend(picture, image, (2.6, 7.0 + 3.2 * number), self.unit)

    def _line(self, text, height, alpha=255):
        letters = font(round(height * self.unit))
        left, top, right, bottom = letters.getbbox(text)
        image = Image.new("RGBA", (right + 2, bottom + 2), (*INK, 0))
        ImageDraw.Draw(image).text((0, 0), text, fill=(*INK, alpha), font=letters)
        return image

    @functools.cached_property
    def _caption_images(self):
        """One line for each part of the caption beside the mill, or one line above the mill."""
        lines = self.caption.split(", ") if self.wide else [self.caption]
        return [self._line(line, 2.4, 200) for line in lines if line]

    # ---- the bar

    def _ticks(self):
        """Labels and their share of the bar."""
        if self.colour.worn:
            return [(label, share) for share, label in self.colour.marks()]
        scale = self.colour.scale[0]
        low, high = (limit / scale for limit in self.colour.limits)
        ticks = MaxNLocator(nbins=6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
        ticks = [t for t in ticks if low - 1e-9 * (high - low) <= t <= high + 1e-9 * (high - low)]
        return [(f"{t:g}", (t - low) / (high - low)) for t in ticks]

    def _draw_bar(self):
        """(place (x, y) [pixels], image) of the bar: vertical on the right, or horizontal below."""
        u, title, ticks = self.unit, self.colour.title, self._ticks()
        small, large = font(round(2.5 * u)), font(round(2.6 * u))
        thick, arrow = round(2.4 * u), round(2.6 * u)
        if self.wide:
            length, head = round(56 * u), round(5.2 * u)
            beside = max(small.getlength(label) for label, _ in ticks) + 1.6 * u
            width = round(max(thick + beside, large.getlength(title) + 2))
            left, top = width - thick - round(beside), head + arrow
            size = width, top + length + round(2 * u)
            at = self.size[0] - width - round(2.2 * u), (self.size[1] - size[1]) // 2
            title_at, tip_at, tip, gap, anchors = width, (left, head), (thick, arrow), 1.2 * u, ("ra", "lm")
        else:
            length, left, top = round(min(self.size[0] - 16 * u, 70 * u)), round(3 * u), round(4.2 * u)
            size = length + arrow + 2 * left, top + thick + round(5 * u)
            at = (self.size[0] - size[0]) // 2, self.size[1] - size[1] - round(1.6 * u)
            title_at, tip_at, tip, gap, anchors = (
                left + length / 2,
                (left + length, top),
                (arrow, thick),
                1.1 * u,
                ("ma", "ma"),
            )

        def beyond(share, away):
            """The point beside the bar at a share of its length, at the distance `away` from its edge."""
            if self.wide:
                return left + thick + away, top + (1 - share) * (length - 1)
            return left + share * (length - 1), top + thick + away

        image = Image.new("RGBA", size, (*INK, 0))
        draw = ImageDraw.Draw(image)
        draw.text((title_at, 0), title, fill=INK, font=large, anchor=anchors[0])
        strip = TABLES[self.colour.map][np.arange(length) * 256 // length]
        block = np.repeat(strip[None], thick, axis=0)
        image.paste(Image.fromarray(np.rot90(block) if self.wide else block), (left, top))
        self._arrow(image, strip[-1], tip_at, tip, upwards=self.wide)
        for label, share in ticks:
            draw.line([beyond(share, 0), beyond(share, 0.7 * u)], fill=INK, width=max(1, round(0.15 * u)))
            draw.text(beyond(share, gap), label, fill=INK, font=small, anchor=anchors[1])
        return at, image

    @staticmethod
    def _arrow(image, colour, at, size, upwards):
        """Draws an arrow at the upper limit in its colour, enlarged and then reduced for smooth edges."""
        width, height = (8 * s for s in size)
        large = Image.new("RGBA", (width, height), (*map(int, colour), 0))
        tip = [(0, height), (width / 2, 0), (width, height)]
        if not upwards:
            tip = [(0, 0), (width, height / 2), (0, height)]
        ImageDraw.Draw(large).polygon(tip, fill=(*map(int, colour), 255))
        image.alpha_composite(large.resize(size, Image.Resampling.BOX), at)


def _blend(picture, image, at, unit=1.0):
    """Draws an RGBA image over `picture` (h, w, 3) in place, with its corner at `at` times `unit` pixels; parts outside
    the picture are cut off."""
    x, y = (max(0, round(a * unit)) for a in at)
    under = picture[y : y + image.size[1], x : x + image.size[0]]
    over = np.asarray(image)[: under.shape[0], : under.shape[1]]
    alpha = over[..., 3:].astype(np.uint16)
    under[:] = (under * (255 - alpha) + over[..., :3] * alpha + 127) // 255
