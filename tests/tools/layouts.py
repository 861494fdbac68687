"""Texts of a figure that are cut off or cover another."""

import matplotlib
import numpy as np
import pytest
from matplotlib.text import Text

from milltools.figures.base import LOOK


def faults(figure) -> list:
    drawn = []
    with pytest.MonkeyPatch.context() as patch, matplotlib.rc_context(LOOK):
        patch.setattr(Text, "draw", lambda text, renderer: drawn.append((text, text.get_window_extent(renderer))))
        figure.draw_without_rendering()
    seen = {text: box for text, box in drawn if text.get_visible() and text.get_text().strip()}
    low, high = (np.array([getattr(box, end) for box in seen.values()]) for end in ("min", "max"))
    over = np.minimum.outer(high, high) - np.maximum.outer(low, low)
    over = np.triu(over.diagonal(axis1=1, axis2=3).min(axis=2) > 1, 1)
    cut = (low < -0.5).any(axis=1) | (high > figure.bbox.max + 0.5).any(axis=1)
    texts = list(seen)
    return [texts[k] for k in np.flatnonzero(cut)] + [(texts[k], texts[j]) for k, j in np.argwhere(over)]
