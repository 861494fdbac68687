"""What is written over a picture: the colour bar, drawn once, and the time, for every frame.

Sizes follow the picture's shorter side. A wide picture has its bar on the right, a narrow one below.
"""

import functools
import pathlib

import matplotlib
import numpy as np
from matplotlib.ticker import MaxNLocator
from PIL import Image, ImageDraw, ImageFont

WIDE = 1.4  # from this ratio of width to height on, the bar is on the right
DARK, LIGHT = (38, 46, 58), (240, 243, 247)


@functools.cache
def font(pixels: int) -> ImageFont.FreeTypeFont:
    """matplotlib's own font: it is on every machine and has every sign."""
    path = pathlib.Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(path, pixels)


class Overlay:
    """The bar of a colour.Colour and the lines of text of a picture of `size` pixels; `ink` is the colour of the writing."""

    def __init__(self, size, colour, caption="", span=1.0, ink=DARK):
        self.size, self.colour, self.caption, self.ink = size, colour, caption, ink
        self.milliseconds = span < 10
        self.unit = max(1.0, min(size) / 100)
        self.wide = size[0] >= WIDE * size[1]
        self._bar = self._draw_bar()

    @property
    def frame(self):
        """What is left for the mill (left, top, right, bottom), in shares of the picture."""
        width, height = self.size
        gap = 2.2 * self.unit
        if self.wide:
            taken = (self._bar[1].size[0] + 2 * gap) / width
            return gap / width, gap / height, 1 - taken, 1 - gap / height
        top, taken = 12 * self.unit / height, (self._bar[1].size[1] + 2 * gap) / height
        return gap / width, top, 1 - gap / width, 1 - taken

    def paste(self, picture, time):
        """Writes over `picture` (h, w, 3 or 4) uint8 in place; `time` in s."""
        at, bar = self._bar
        _blend(picture, bar, at)
        text = f"t = {time * 1e3:.2f} ms" if self.milliseconds else f"t = {time:.4f} s"
        _blend(picture, self._line(text, 3.4), (2.6, 2.0), self.unit)
        for number, image in enumerate(self._caption_images):
            _blend(picture, image, (2.6, 7.0 + 3.2 * number), self.unit)

    def _line(self, text, height, alpha=255):
        letters = font(round(height * self.unit))
        left, top, right, bottom = letters.getbbox(text)
        image = Image.new("RGBA", (right + 2, bottom + 2), (*self.ink, 0))
        ImageDraw.Draw(image).text((0, 0), text, fill=(*self.ink, alpha), font=letters)
        return image

    @functools.cached_property
    def _caption_images(self):
        """A line for each part where it stands beside the mill, not above it."""
        lines = self.caption.split(", ") if self.wide else [self.caption]
        return [self._line(line, 2.4, 200) for line in lines if line]

    # ---- the bar

    def _draw_bar(self):
        """Where the bar's picture goes (x, y) [pixels], and the picture."""
        return self._tall() if self.wide else self._flat()

    def _ticks(self):
        """Labels and their share of the bar."""
        scale = self.colour.scale[0]
        low, high = (limit / scale for limit in self.colour.limits)
        ticks = MaxNLocator(nbins=6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
        ticks = [t for t in ticks if low - 1e-9 * (high - low) <= t <= high + 1e-9 * (high - low)]
        return [(f"{t:g}", (t - low) / (high - low)) for t in ticks]

    def _strip(self, length):
        """Colours (length, 3) from the lower limit to the upper one."""
        low, high = self.colour.limits
        return self.colour.rgb(low + (high - low) * (np.arange(length) + 0.5) / length)

    def _tall(self):
        u = self.unit
        length, thick = round(56 * u), round(2.4 * u)
        small, title = font(round(2.5 * u)), font(round(2.6 * u))
        head, arrow = round(5.2 * u), round(2.6 * u)
        beside = max(small.getlength(label) for label, _ in self._ticks()) + 1.6 * u
        width = round(max(thick + beside, title.getlength(self.colour.title) + 2))
        image = Image.new("RGBA", (width, head + arrow + length + round(2 * u)), (*self.ink, 0))
        draw = ImageDraw.Draw(image)
        draw.text((width, 0), self.colour.title, fill=self.ink, font=title, anchor="ra")
        left, top = width - thick - round(beside), head + arrow
        strip = self._strip(length)[::-1]
        block = np.repeat(strip[:, None, :], thick, axis=1)
        image.paste(Image.fromarray(block), (left, top))
        self._arrow(image, strip[0], (left, head), (thick, arrow), upwards=True)
        for label, share in self._ticks():
            y = top + (1 - share) * (length - 1)
            draw.line([(left + thick, y), (left + thick + 0.7 * u, y)], fill=self.ink, width=max(1, round(0.15 * u)))
            draw.text((left + thick + 1.2 * u, y), label, fill=self.ink, font=small, anchor="lm")
        at = self.size[0] - width - round(2.2 * u), (self.size[1] - image.size[1]) // 2
        return at, image

    def _flat(self):
        u = self.unit
        length, thick = round(min(self.size[0] - 16 * u, 70 * u)), round(2.4 * u)
        small, title = font(round(2.5 * u)), font(round(2.6 * u))
        head, arrow = round(4.2 * u), round(2.6 * u)
        left = round(3 * u)
        image = Image.new("RGBA", (length + arrow + 2 * left, head + thick + round(5 * u)), (*self.ink, 0))
        draw = ImageDraw.Draw(image)
        draw.text((left + length / 2, 0), self.colour.title, fill=self.ink, font=title, anchor="ma")
        strip = self._strip(length)
        image.paste(Image.fromarray(np.repeat(strip[None], thick, axis=0)), (left, head))
        self._arrow(image, strip[-1], (left + length, head), (arrow, thick), upwards=False)
        for label, share in self._ticks():
            x, y = left + share * (length - 1), head + thick
            draw.line([(x, y), (x, y + 0.7 * u)], fill=self.ink, width=max(1, round(0.15 * u)))
            draw.text((x, y + 1.1 * u), label, fill=self.ink, font=small, anchor="ma")
        at = (self.size[0] - image.size[0]) // 2, self.size[1] - image.size[1] - round(1.6 * u)
        return at, image

    @staticmethod
    def _arrow(image, colour, at, size, upwards):
        """Beyond the upper limit: an arrow of its colour, drawn large and shrunk for clean edges."""
        width, height = (8 * s for s in size)
        large = Image.new("RGBA", (width, height), (*map(int, colour), 0))
        tip = [(0, height), (width / 2, 0), (width, height)]
        if not upwards:
            tip = [(0, 0), (width, height / 2), (0, height)]
        ImageDraw.Draw(large).polygon(tip, fill=(*map(int, colour), 255))
        image.alpha_composite(large.resize(size, Image.Resampling.BOX), at)


def _blend(picture, image, at, unit=1.0):
    """An RGBA image over `picture` (h, w, 3 or 4) in place, its corner `at` times `unit` pixels; what stands out is left away."""
    x, y = (max(0, round(a * unit)) for a in at)
    under = picture[y : y + image.size[1], x : x + image.size[0]]
    over = np.asarray(image)[: under.shape[0], : under.shape[1]]
    alpha = over[..., 3:].astype(np.uint16)
    mixed = under[..., :3] * (255 - alpha) + over[..., :3] * alpha
    if picture.shape[2] == 4:
        below = under[..., 3:].astype(np.uint16)
        total = alpha + below * (255 - alpha) // 255
        straight = over[..., :3] * alpha + under[..., :3] * (below * (255 - alpha) // 255)
        under[..., :3] = straight // np.maximum(total, 1)
        under[..., 3:] = total
    else:
        under[..., :3] = (mixed + 127) // 255
