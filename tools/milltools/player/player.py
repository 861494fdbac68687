"""The balls themselves, turning, in 3D: the player of the report, a piece of HTML that needs nothing but itself.

    text = page(run, "a mill")                      # a page of its own
    balls, shared = fragment(run), scripts()        # parts of a larger one: `balls` of each run, `shared` once

The browser draws it with WebGL through three.js (vendor/, MIT licence); frames.py says what it gets. It opens from
file:// and asks the network for nothing. Where there is no WebGL, no JavaScript, or a printer, the picture `still`
stands there instead, with a line that says why. Everything that comes from a deck is escaped. Frames are shown as they
are stored: between two of them balls collide many times, so that paths drawn in between would be invented.
"""

import base64
import hashlib
import pathlib

import matplotlib
import numpy as np

from milltools import pages
from milltools.base.text import plain
from milltools.figures.style import SPEEDS
from milltools.geometry.bodies import Mill
from milltools.player import frames
from milltools.player.finer import Finer
from milltools.render import camera, colour

FOLDER = pathlib.Path(__file__).parent
VIEWS = ("front", "three-quarter")  # as in mill render


def no_frames(run) -> str:
    """Why there is nothing to be seen turning, as a sentence; "" if there is something."""
    if len(run.frame_times()):
        return ""
    why = "output.frames is 0 s" if run.time > 0 else "it has not come to its first checkpoint"
    return f"No ball states are stored in this run: {why}."


def fragment(run, most_bytes: int = 6_000_000, still: bytes | None = None) -> str:
    """The player of a milltools.read.runfile.Run as HTML, at most `most_bytes` long if that can be (frames are left
    out, then balls); `still`: a PNG for where it cannot be drawn. The page needs scripts() once."""
    why = no_frames(run)
    if why:
        return _template("player.html").render(still=_text(still), why=why, head=None, caption="")
    bare = len(_whole(run, frames.planned(run), still).encode())
    return _whole(run, frames.pack(run, (most_bytes - bare) // 4 * 3), still)


def page(run, title: str) -> str:
    """The player as a page of its own, which needs nothing else: for a notebook's frame, or a file."""
    return _template("page.html").render(title=plain(title), policy=policy(), player=fragment(run), scripts=scripts())


def _scripts() -> list[str]:
    return [(FOLDER / name).read_text("utf-8") for name in ("vendor/three.min.js", "mill3d.js", "player.js")]


def scripts() -> str:
    """Style and scripts of all players of a page: to be put into it once, anywhere."""
    style = (FOLDER / "player.css").read_text("utf-8")
    return f"<style>{style}</style>\n" + "".join(f"<script>{text}</script>\n" for text in _scripts())


def policy(*others: str) -> str:
    """The Content-Security-Policy of a page with players: nothing is loaded from anywhere, only our scripts and the
    `others` run.

    Scripts are allowed by their hash: were something of a deck ever to come through unescaped, it would still not be
    executed."""
    hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in (*_scripts(), *others)]
    run = " ".join(f"'sha256-{one}'" for one in hashes)
    return (
        f"default-src 'none'; script-src {run}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


def _text(data: bytes | None) -> str:
    return base64.b64encode(data or b"").decode()


def _template(name):
    found = pages.environment(FOLDER)
    found.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    return found.get_template(name)


def _whole(run, packed, still):
    head = _head(run, packed)
    colours = matplotlib.colormaps[SPEEDS](np.linspace(0, 1, 17), bytes=True)[:, :3]
    return _template("player.html").render(
        still=_text(still),
        why="",
        head=head,
        speeds=_speeds(head["interval"], 20 if head["smooth"] else 10),
        gradient=",".join("rgb({},{},{})".format(*c) for c in colours),
        caption=_caption(run, packed, head),
        data=_text(packed.data),
    )


# ---- what the scripts get


def _head(run, packed):
    times = run.frame_times()[packed.index]
    up, views = _views(run, packed.index[0])
    mill = Mill.of(run)
    poses = [run.poses(int(k)) for k in packed.index]
    names = list(poses[0])
    begin = run.quantity("run/sample_from", 0.0)
    later = np.flatnonzero(times >= begin * (1 - 1e-9))
    table = matplotlib.colormaps[SPEEDS](np.arange(256), bytes=True)[:, :3]
    return {
        "drawn": len(packed.chosen),
        "times": times.tolist(),
        "labels": _labels(times),
        "smooth": isinstance(run, Finer),
        "interval": float(np.median(np.diff(times))) if len(times) > 1 else 0.0,
        "motions": names,
        "carrier": names.index(mill.carrier) if mill.carrier in names else -1,
        "rides": mill.wanders,
        "poses": _numbers([[pose[name] for name in names] for pose in poses], "<f4"),
        "bodies": _bodies(mill, names),
        "edges": {"lines": _numbers(mill.edges, "<f4"), "width": mill.rim},
        # points that a view holds: of all that the container sweeps, and of it as in the first frame
        "hulls": [_numbers(hull, "<f4") for hull in (mill.hull, mill.swept(poses[:1]))],
        "first": int(later[0]) if len(later) else 0,
        "lower": packed.lower.tolist(),
        "upper": packed.upper.tolist(),
        "runs": _runs(run.balls("diameter")[packed.chosen]),
        "values": [_quantity(name, limit) for name, limit in packed.limits.items()],
        "colours": _text(table.tobytes()),
        "up": up,
        "views": views,
    }


def _labels(times):
    """Times as they are read: all in ms with as many places as they need, at most three."""
    ms = times * 1e3
    places = next((p for p in range(3) if np.allclose(ms, np.round(ms, p), atol=1e-6)), 3)
    return [f"t = {t:.{places}f} ms" for t in ms]


def _runs(diameters):
    """[[how many, diameter], ...] along the rows."""
    starts = np.flatnonzero(np.diff(diameters, prepend=np.nan))
    many = np.diff(starts, append=len(diameters))
    return [[int(n), float(diameters[k])] for n, k in zip(many, starts, strict=True)]


def _numbers(values, kind) -> str:
    return _text(np.ascontiguousarray(values, kind).tobytes())


def _bodies(mill, names):
    """What is drawn beside the balls: look, number of the motion (-1: none), points [m] and the triangles' corners."""
    parts = [("shell", mill.carrier, mill.glass)]
    for motion in dict.fromkeys(body.motion for body in mill.inner):
        own = [body.triangles for body in mill.inner if body.motion == motion]
        parts.append(("steel", motion, np.concatenate(own)))
    found = []
    for look, motion, triangles in parts:
        corners = triangles.reshape(-1, 3).astype("<f4")
        points, index = np.unique(corners, axis=0, return_inverse=True)
        wide = len(points) >= 1 << 16
        found.append(
            {
                "look": look,
                "motion": names.index(motion) if motion in names else -1,
                "points": _numbers(points, "<f4"),
                "corners": _numbers(index, "<u4" if wide else "<u2"),
                "wide": wide,
            }
        )
    return found


def _views(run, first):
    """What is up (against gravity, else +z), and from where the named views look."""
    gravity = run.vector("gravity/acceleration")
    size = np.linalg.norm(gravity)
    up = -gravity / size if size > 0 else np.array([0.0, 0.0, 1.0])
    level = np.eye(3) - np.outer(up, up)  # columns: the axes, made level
    ahead = level[:, 0] if abs(up[0]) < 0.99 else level[:, 1]  # along the drum, unless it stands
    ahead = ahead / np.linalg.norm(ahead)
    views = {"end": run.frame_axis(run.poses(int(first))).tolist()}
    for name in VIEWS:
        azimuth, elevation, _ = camera.PRESETS[name]
        a, e = np.radians([azimuth, elevation])
        along = np.cos(a) * ahead + np.sin(a) * np.cross(up, ahead)
        views[name] = (np.cos(e) * along + np.sin(e) * up).tolist()
    return up.tolist(), views


def _quantity(name, limit):
    """A choice of colour, with the ticks of its bar as [share, text]."""
    label, (scale, unit) = colour.QUANTITIES[name].label, colour.Colour(name, (0.0, limit)).scale
    end = limit / scale
    power = 10.0 ** np.floor(np.log10(end))
    step = next(m * power for m in (0.2, 0.25, 0.5, 1, 2, 5) if end / (m * power) <= 5 + 1e-9)
    between = [k * step for k in range(6) if k * step < 0.87 * end]  # the last word is a long one
    ticks = [[round(v / end, 4), f"{v:.4g}"] for v in between] + [[1, f"≥ {end:.4g} {unit}"]]
    return {
        "name": name,
        "label": label,
        "limit": limit,
        "ticks": ticks,
        "describe": f"Colours: {label} from 0, dark blue, to {end:.4g} {unit} and more, dark red",
    }


# ---- what stands on the page


def _speeds(interval, rate):
    """(value, words, whether it is chosen): simulated seconds a second, from one to thirty frames a second, some `rate`
    of them chosen."""
    if interval <= 0:
        return [("1", "1", False)]
    factors = [m * 10.0**p for p in range(-9, 4) for m in (1, 2, 5)]
    useful = [f for f in factors if 1 <= f / interval * (1 + 1e-9) <= 31] or [interval]
    chosen = min(useful, key=lambda f: abs(np.log(f / interval / rate)))
    return [(f"{f:.10g}", _factor(f), f == chosen) for f in useful]


def _factor(factor):
    if factor > 1:
        return f"{factor:.4g} × real time"
    return f"1/{1 / factor:.4g} of real time" if factor < 1 else "real time"


def _caption(run, packed, head):
    """What is seen, what is left out, and why nothing moves between frames."""
    words = [_balls(run, packed) + "."]
    here, stored = len(packed.index), len(run.frame_times())
    if here < stored and not isinstance(run, Finer):
        stride = int(packed.index[1]) if here > 1 else stored
        words.append(f"Every {_ordinal(stride)} stored frame is here, {here} of {stored}.")
    if here > 1:
        words.append(_between(run, head["interval"]))
    return " ".join(words)


def _balls(run, packed):
    names = run.species_names()
    species, diameter = run.balls("species"), run.balls("diameter")
    kinds = []
    for k in np.unique(species):
        own = diameter[species == k]
        name = names[k] if k < len(names) else "balls"
        size = f"{own.min() * 1e3:.4g}"
        if own.max() > own.min():
            size += f" to {own.max() * 1e3:.4g}"
        noun = "balls" if name == "balls" else f"balls “{name}”"
        kinds.append(f"{len(own)} {noun} of {size} mm")
    text = ", ".join(kinds)
    drawn, every = len(packed.chosen), len(diameter)
    if drawn < every:
        step = int(packed.chosen[1]) if drawn > 1 else every
        text += f"; every {_ordinal(step)} ball is drawn, {drawn} of {every}"
    return text


def _between(run, interval):
    text = f"Frames are {interval * 1e3:.4g} ms apart"
    facts = []
    if not run.unsampled:
        rates = {kind: float(run.statistic(f"impacts/{kind}/rate")) for kind in run.kinds}
        rate = sum(rates.values()) + rates["ball_ball"]  # two balls have each of these
        many = rate * interval / len(run.balls("diameter"))
        facts.append(f"a ball has {_plain(many)} impact{'s' * (_plain(many) != '1')}")
    if run.driven == "rotor":
        turn = interval / run.period
        angle = f"{360 * turn:.3g}°" if turn < 1.5 else f"{_plain(turn)} turns"
        facts.append(f"the rotor turns by {angle}")
    elif np.isfinite(run.period):
        share = interval / run.period
        facts.append(f"{_plain(share)} of a period of the slowest motion goes by")
    if facts:
        text += f"; from one to the next {' and '.join(facts)}"
    if isinstance(run, Finer):
        return f"{text}. They come of running the deck again, to the same bits: the file's own are farther apart."
    return text + ". What lies between is not drawn, since it is not stored."


def _plain(value: float) -> str:
    """Two digits that count, never as a power of ten."""
    return f"{float(f'{value:.2g}'):,.10g}".replace(",", " ")


def _ordinal(n: int) -> str:
    ending = "th" if n % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(n % 10, "th")
    return f"{n}{ending}"
