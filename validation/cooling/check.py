"""Cooling: Haff's law, the shape of the velocity distribution, and the rotational energy of rough spheres.

README.md says what is claimed and where each band comes from.
"""

from cooling.figures import draw
from cooling.haff import check_smooth
from cooling.rough import check_rough


def check(case):
    # A start file is looked for beside the deck
    case.write("deck.ini", (case.folder / "deck.ini").read_text())
    smooth = check_smooth(case)
    rough = check_rough(case)
    draw(case, smooth, rough)
