"""Small runs for the tests of the player, and what its data are by the words of milltools/report/frames.py alone."""

import base64
import gzip
import io
import json
import re
import subprocess

import h5py
import matplotlib.image
import numpy as np
from conftest import PROGRAM, SMALL

from milltools.player import player

MIXED = SMALL.replace(
    "[balls]\ncount = 20\ndiameter = 5 mm\n",
    "[balls.coarse]\ncount = 120\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n[balls.fine]\ncount = 80\ndiameter = 3 mm\n",
)
LONE = (  # one blade, and a ball of half a millimetre that hides nothing
    SMALL.replace("count = 20\ndiameter = 5 mm", "count = 1\ndiameter = 0.5 mm")
    .replace("count = 2\n", "count = 1\n", 1)
    .replace("shaft_radius = 5 mm", "shaft_radius = 5 mm\nangle = 20 deg")
)
PAGE = """\
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>mill</title>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; \
style-src 'unsafe-inline'; img-src data:">
<style>:root {{ color-scheme: light dark }} body {{ margin: 0; background: Canvas; color: CanvasText }} \
.tall {{ height: 2000px }}</style>
</head><body>{0}</body></html>
"""


def simulate(folder, deck, *options):
    """Runs a deck in a folder, with "section.key=value" set, and returns its file."""
    (folder / "deck.ini").write_text(deck)
    words = [word for option in options for word in ("-s", option)]
    done = subprocess.run([PROGRAM, "-q", "deck.ini", *words], cwd=folder, capture_output=True)
    assert done.returncode == 0, done.stderr
    return folder / "deck.h5"


def numbers(text, kind):
    """Of a field of the head that is base64."""
    return np.frombuffer(base64.b64decode(text), kind)


def poses(head):
    """(F, motions, 3, 4): three rows of four, a point p is at rotation p + centre."""
    return numbers(head["poses"], "<f4").reshape(len(head["times"]), -1, 3, 4)


def points(head, look):
    """Corners (N, 3) [m] of what has a look: "shell", "rim", "steel"."""
    found = [numbers(b["points"], "<f4") for b in head["bodies"] if b["look"] == look]
    return np.concatenate(found).reshape(-1, 3)


def red(width=16, height=9):
    """A still to be told from everything else, a PNG."""
    store = io.BytesIO()
    matplotlib.image.imsave(store, np.full((height, width, 3), (255, 0, 0), np.uint8))
    return store.getvalue()


def coloured(picture):
    """(h, w) bool: where a picture has strong colours, as only balls have."""
    return np.ptp(picture.astype(int), axis=2) > 60


def write_page(path, *fragments):
    """A page of players and nothing else, as strict about what it loads as the report."""
    path.write_text(PAGE.format("".join(fragments) + player.scripts()), "utf-8")
    return path


def part(fragment, name):
    """Content of the <script> of a fragment with the class mp-NAME."""
    return re.search(rf'<script [^>]*class="mp-{name}">(.*?)</script>', fragment, re.DOTALL)[1]


def head(fragment):
    return json.loads(part(fragment, "head"))


def decode(fragment):
    """(position (F, n, 3) [m], levels by quantity (F, n)): planes, zigzag and forecasts undone one frame after the
    other."""
    facts = head(fragment)
    raw = gzip.decompress(base64.b64decode(part(fragment, "data"), validate=True))
    frames, balls = len(facts["times"]), facts["drawn"]
    rows = np.frombuffer(raw, np.uint8).reshape(frames, 10, balls)
    squares = rows[:, :3].view(np.int8).astype(float)
    squares *= abs(squares)
    places, now, before = [], np.zeros((3, balls), int), None
    for row, after in zip(rows[:, 4:].astype(int), squares, strict=True):
        if before is not None:
            now = now + np.floor(np.array(facts["forecast"])[:, None] * (before + after) + 0.5).astype(int)
        zigzag = 256 * row[0::2] + row[1::2]
        now = (now + np.where(zigzag % 2, -(zigzag + 1) // 2, zigzag // 2)) % 65536
        places.append(now)
        before = after
    lower, upper = np.array(facts["lower"]), np.array(facts["upper"])
    position = lower + np.stack(places).transpose(0, 2, 1) * (upper - lower) / 65535
    mass = np.concatenate([np.full(n, m) for n, _, m in facts["runs"]])
    speed = np.linalg.norm(squares, axis=1) * facts["fastest"] / 127**2
    values = {"speed": speed, "spin": rows[:, 3].astype(float) ** 2 * facts["spinning"] / 255**2}
    values["energy"] = mass * speed**2 / 2
    limits = {v["name"]: v["limit"] for v in facts["values"]}
    return position, {name: np.minimum(256 * values[name] // limits[name], 255) for name in limits}


def worn(fragment):
    """(bodies, values by quantity (facets,) [SI]) of the wear; of each body the corners of its triangles (T, 3, 3) [m]
    in the frame of its motion, and their facets (T,)."""
    facts = head(fragment)
    raw, at = gzip.decompress(base64.b64decode(part(fragment, "worn"), validate=True)), 0

    def take(kind, count):
        nonlocal at
        at += count * np.dtype(kind).itemsize
        return np.frombuffer(raw[:at], kind)[-count:]

    bodies, values = [], {}
    for body in facts["wear"]["bodies"]:
        corners, facet = (np.cumsum(take("<i4", n * body["triangles"])) for n in (3, 1))
        points = body["lower"] + body["step"] * take("<u2", 3 * body["points"]).reshape(3, -1).T.astype(float)
        bodies.append(body | {"corners": points[corners].reshape(-1, 3, 3), "facet": facet})
    for one in facts["wear"]["values"]:
        level, low = take("u1", facts["wear"]["facets"]).astype(float), one["low"]
        values[one["name"]] = np.where(level > 0, low * (one["limit"] / low) ** ((level - 1) / 254), 0)
    assert at == len(raw)
    return bodies, values


def stored(run, name, index):
    """The frames `index` of a run as float64 (F, N, 3)."""
    return np.stack([run.frame(int(k), name) for k in index]).astype(float)


def change(path, **datasets):
    """Puts other values into a run, "__" for "/" in their names."""
    with h5py.File(path, "r+") as file:
        for name, value in datasets.items():
            file[name.replace("__", "/")][...] = value
    return path
