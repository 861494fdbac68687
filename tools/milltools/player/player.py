"""The 3D player of the report with the moving balls: a piece of HTML that needs no other files.

    text = page(run, "a mill")                      # a page of its own
    balls, shared = fragment(run), scripts()        # parts of a larger one: `balls` of each run, `shared` once

The browser draws it with WebGL through three.js (vendor/, MIT licence); frames.py describes the data. It works from
file:// and loads nothing from the network. Without WebGL or JavaScript, and in print, it shows the picture `still` and
the reason. All texts from a deck are escaped. If the frames are close, balls and bodies move between them too
(mill3d.js), and hard impacts flash; frames that are far apart are shown as they are.

Runs that are shown together need the same colours: give all of them the same `limits`, as parts.balls() does. In the
page they are in the JSON of <script class="mp-head">: values[k].limit [SI] is the end of a scale, with its `ticks`.
"""

import base64
import pathlib

import numpy as np

from milltools import pages
from milltools.base.text import plain, quantity
from milltools.geometry import trajectory
from milltools.geometry.bodies import Mill
from milltools.player import frames, worn
from milltools.player.finer import Finer
from milltools.read import motions
from milltools.render import camera, colour, states

FOLDER = pathlib.Path(__file__).parent
VIEWS = ("front", "three-quarter")  # as in mill render
WEAR_SHARE = 0.1  # of the size of a player: wear that needs more is left out
WEAR = "Wear of the parts is the mean over the sampled window. Parts without impacts are grey."
PAIRS = 4  # pairs of frames in which flights are counted


def no_frames(run) -> str:
    """Why the player has no frames to show, as a sentence; "" if it has."""
    if len(run.frame_times()):
        return ""
    why = "output.frames is 0 s" if run.time > 0 else "the run has not come to its first checkpoint"
    return f"No ball states are stored in this run: {why}."


def fragment(run, most_bytes: int = 6_000_000, still: bytes | None = None, limits=None, sparks=None) -> str:
    """The player of a milltools.read.runfile.Run as HTML, at most `most_bytes` long if possible: frames are left out,
    and balls if at least frames.FEWEST_BALLS remain. `still`: a PNG to show where WebGL does not work; `limits`: ends
    of the colour scales {quantity: value [SI]} of scales(), instead of the run's own; `sparks`: flashes(). The page
    needs scripts() once."""
    why = no_frames(run)
    if why:
        return _template("player.html").render(still=_text(still), why=why, head=None, caption="")
    limits = limits or scales([run])
    balls = {name: limits[name] for name in frames.SHOWN}
    wear = worn.pack(run, {name: limits[name] for name in colour.WEAR if name in limits}) if worn.there(run) else None
    wear = wear if wear and len(wear[1]) < WEAR_SHARE * most_bytes else (None, b"")
    sparks, planned = sparks or flashes(run), frames.planned(run, balls)
    room = (most_bytes - len(_whole(run, planned, still, sparks, *wear).encode())) // 4 * 3
    return _whole(run, frames.pack(run, room, balls, isinstance(run, Finer)), still, sparks, *wear)


def scales(runs) -> dict:
    """The colours of runs that are shown together: the end [SI] of the scale of each of frames.SHOWN, and both ends of
    those of wear."""
    return {name: colour.shared(runs, name)[1] for name in frames.SHOWN} | worn.scales(runs)


def page(run, title: str) -> str:
    """A complete page with only the player: for a frame in a notebook, or for a file."""
    return _template("page.html").render(title=plain(title), policy=policy(), player=fragment(run), scripts=scripts())


def _scripts() -> list[str]:
    return [(FOLDER / name).read_text("utf-8") for name in ("vendor/three.min.js", "mill3d.js", "player.js")]


def scripts() -> str:
    """Style and scripts for all players of a page: to be put into the page once, anywhere."""
    style = (FOLDER / "player.css").read_text("utf-8")
    return f"<style>{style}</style>\n" + "".join(f"<script>{text}</script>\n" for text in _scripts())


def policy(*others: str) -> str:
    """The Content-Security-Policy of a page with players: it loads nothing, and runs only the scripts of the player and
    `others`."""
    return pages.policy([*_scripts(), *others])


def _text(data: bytes | None) -> str:
    return base64.b64encode(data or b"").decode()


def _template(name):
    found = pages.environment(FOLDER)
    found.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    return found.get_template(name)


def flashes(run) -> states.Flashes | None:
    """The states.Flashes of the frames of a run, for the slow motion that is chosen first; None without a log of
    impacts, or if the frames are far apart."""
    times, log = run.frame_times(), run.log if isinstance(run, Finer) else run
    if not log.has("impacts/time") or not frames.close(times, run):
        return None
    factor = next(float(value) for value, _, chosen in _speeds(float(np.median(np.diff(times))), True) if chosen)
    return states.Flashes(log, run, float(times[0]), float(times[-1]), states.SEEN * factor)


def _whole(run, packed, still, flashes, wear, worn_parts):
    head = _head(run, packed, flashes) | {"wear": wear}
    colours = colour.TABLES["speeds"][:: 255 // 15]
    return _template("player.html").render(
        still=_text(still),
        why="",
        head=head,
        speeds=_speeds(head["interval"], head["between"]),
        gradient=",".join("rgb({},{},{})".format(*c) for c in colours),
        caption=_caption(run, packed, head, flashes) + bool(wear) * f" {WEAR}",
        data=_text(packed.data),
        worn=_text(worn_parts),
    )


# ---- data for the scripts


def _head(run, packed, flashes):
    times = run.frame_times()[packed.index]
    labels, places = _labels(times)
    up, views = views_of(run, packed.index[0])
    mill = Mill.of(run)
    poses = [run.poses(int(k)) for k in packed.index]
    names = list(poses[0])
    begin = run.window[0]
    later = np.flatnonzero(times >= begin * (1 - 1e-9))
    shown = np.column_stack([flashes.time, flashes.place, flashes.radius]) if flashes else np.empty((0, 5))
    return {
        "drawn": len(packed.chosen),
        "times": times.tolist(),
        "labels": labels,
        "turns": None if (done := turns(run, times)) is None else done.tolist(),
        "slice": run.slice_length,  # [m] along x, between periodic ends; 0: none
        "between": packed.close,  # whether states between the frames are drawn
        "places": places,
        "interval": float(np.median(np.diff(times))) if len(times) > 1 else 0.0,
        "motions": names,
        # per frame: velocity [m/s], at the origin, and angular velocity [rad/s] of the frame of the charge; or nothing
        "twists": _numbers([t for k in packed.index if (t := run.twist(int(k))) is not None], "<f4"),
        "carrier": names.index(mill.carrier) if mill.carrier in names else -1,
        "rides": mill.wanders,
        "poses": _numbers([[pose[name] for name in names] for pose in poses], "<f4"),
        "bodies": [_coded(body) for body in bodies(mill, names)],
        "edges": {"lines": _numbers(mill.edges, "<f4"), "width": mill.rim},
        # points that must be visible: of the space that the container sweeps, and of the container in the first frame
        "hulls": [_numbers(hull, "<f4") for hull in (mill.hull, mill.swept(poses[:1]))],
        "first": int(later[0]) if len(later) else 0,
        "lower": packed.lower.tolist(),
        "upper": packed.upper.tolist(),
        "fastest": packed.fastest,
        "spinning": packed.spinning,
        "forecast": packed.forecast,
        "gravity": run.vector("gravity/acceleration").tolist(),
        "runs": runs_of(run.balls("diameter")[packed.chosen], run.balls("mass")[packed.chosen]),
        # time [s], place in the frame of the carrier and radius [m] of each; for how many seconds of the reader's
        # time one is seen
        "flashes": _numbers(shown, "<f4"),
        "seen": states.SEEN,
        "values": [_quantity(name, limit, colour.seen(run, name)) for name, limit in packed.limits.items()],
        "colours": _text(colour.TABLES["speeds"].tobytes()),
        "up": up,
        "views": views,
    }


def turns(run, times) -> np.ndarray | None:
    """How far the rotor, else the motion of the container, else the slowest turn has turned at each time [turns]; None
    if nothing turns. Linked players show frames of equal angle together."""
    turning = [name for name in run.motions if motions.rate(run, name)]
    if not turning:
        return None
    slowest = min(turning, key=lambda name: abs(motions.rate(run, name)))
    name = next((one for one in ("rotor", run.carrier) if one in turning), slowest)
    speed = motions.rate(run, name)
    begin = run.rotor_angle(0.0) if name == "rotor" else run.quantity(f"motion.{name}/angle", 0.0)
    return (speed * np.asarray(times) + begin) * np.sign(speed) / (2 * np.pi)


def last_turn(run) -> float | None:
    """The time of the last frame at or before which a turn has ended [s]: so the frames of several runs end at one
    angle. None if nothing turns, or not so far."""
    times = run.frame_times()
    done = turns(run, times[[0, -1]]) if len(times) else None
    if done is None or (whole := np.floor(done[1] + 1e-6)) <= done[0]:
        return None
    return float(np.interp(whole, done, times[[0, -1]]))


def _labels(times):
    """Labels of the times, all in ms, and their number of decimal places, the same for all and at most three."""
    ms = times * 1e3
    places = next((p for p in range(3) if np.allclose(ms, np.round(ms, p), atol=1e-6)), 3)
    return [f"t = {t:.{places}f} ms" for t in ms], places


def runs_of(diameters, masses):
    """[[number, diameter, mass], ...] of consecutive balls of equal diameter and mass."""
    starts = np.flatnonzero(np.diff(diameters, prepend=np.nan) + np.diff(masses, prepend=np.nan))
    many = np.diff(starts, append=len(diameters))
    return [[int(n), float(diameters[k]), float(masses[k])] for n, k in zip(many, starts, strict=True)]


def _numbers(values, kind) -> str:
    return _text(np.ascontiguousarray(values, kind).tobytes())


def bodies(mill, names) -> list[dict]:
    """The bodies to draw: look, index of the motion in `names` (-1: none), points (n, 3) [m], the corners of the
    triangles as uint16, or uint32 if there are too many points, and lines (E, 2, 3) and width [m] of the sharp edges of
    the bodies in the container."""
    parts = [("shell", mill.carrier, mill.glass, np.empty((0, 2, 3)))]
    for motion in dict.fromkeys(body.motion for body in mill.inner):
        own = [body.triangles for body in mill.inner if body.motion == motion]
        parts.append(("steel", motion, np.concatenate(own), mill.creases[motion]))
    found = []
    for look, motion, triangles, lines in parts:
        points, index = np.unique(triangles.reshape(-1, 3).astype("<f4"), axis=0, return_inverse=True)
        found.append(
            {
                "look": look,
                "motion": names.index(motion) if motion in names else -1,
                "points": points,
                "corners": index.ravel().astype("<u4" if len(points) >= 1 << 16 else "<u2"),
                "creases": {"lines": lines.astype("<f4"), "width": mill.line},
            }
        )
    return found


def _coded(body):
    """A body with its arrays as base64 texts."""
    corners, creases = body["corners"], body["creases"]
    return body | {
        "points": _text(body["points"].tobytes()),
        "corners": _text(corners.tobytes()),
        "wide": corners.itemsize == 4,
        "creases": creases | {"lines": _text(creases["lines"].tobytes())},
    }


def views_of(run, first):
    """The upward direction (against gravity, else +z), and the directions of the named views."""
    gravity = run.vector("gravity/acceleration")
    size = np.linalg.norm(gravity)
    up = -gravity / size if size > 0 else np.array([0.0, 0.0, 1.0])
    level = np.eye(3) - np.outer(up, up)  # columns: the horizontal parts of the axes
    ahead = level[:, 0] if abs(up[0]) < 0.99 else level[:, 1]  # along the drum, unless it is upright
    ahead = ahead / np.linalg.norm(ahead)
    views = {"end": run.frame_axis(run.poses(int(first))).tolist()}
    for name in VIEWS:
        azimuth, elevation, _ = camera.PRESETS[name]
        a, e = np.radians([azimuth, elevation])
        along = np.cos(a) * ahead + np.sin(a) * np.cross(up, ahead)
        views[name] = (np.cos(e) * along + np.sin(e) * up).tolist()
    return up.tolist(), views


def _quantity(name, limit, seen):
    """A quantity for the colours, with the ticks of its bar as [share, text]; mill3d.js has its values."""
    label, (scale, unit) = colour.QUANTITIES[name].label + seen, colour.Colour(name, (0.0, limit)).scale
    end = limit / scale
    power = 10.0 ** np.floor(np.log10(end))
    step = next(m * power for m in (0.2, 0.25, 0.5, 1, 2, 5) if end / (m * power) <= 5 + 1e-9)
    between = [k * step for k in range(6) if k * step < 0.87 * end]  # the text at the end is long
    ticks = [[round(v / end, 4), f"{v:.4g}"] for v in between] + [[1, f"≥ {end:.4g} {unit}"]]
    return {
        "name": name,
        "label": label,
        "limit": limit,
        "ticks": ticks,
        "describe": f"Colours: {label} from 0, dark blue, to {end:.4g} {unit} and more, yellow",
    }


# ---- texts of the page


def _speeds(interval, between):
    """[(value, words, whether it is the default)]: simulated seconds per second, for one to thirty frames per second,
    or from a fiftieth of a frame if states `between` frames are drawn. The default is near 20 (or 10) frames."""
    if interval <= 0:
        return [("1", "1", False)]
    factors = [m * 10.0**p for p in range(-9, 4) for m in (1, 2, 5)]
    least, rate = (0.02, 20) if between else (1, 10)
    useful = [f for f in factors if least <= f / interval * (1 + 1e-9) <= 31] or [interval]
    chosen = min(useful, key=lambda f: abs(np.log(f / interval / rate)))
    return [(f"{f:.10g}", _factor(f), f == chosen) for f in useful]


def _factor(factor):
    if factor > 1:
        return f"{factor:.4g} × real time"
    return f"1/{1 / factor:.4g} of real time" if factor < 1 else "real time"


def _caption(run, packed, head, flashes):
    """The caption: what is shown, what is left out, and what happens between the frames."""
    words = [_balls(run, packed) + "."]
    here, stored = len(packed.index), len(run.frame_times())
    if here < stored and not isinstance(run, Finer):
        stride = int(packed.index[1]) if here > 1 else stored
        words.append(f"The player has every {_ordinal(stride)} stored frame, {here} of {stored}.")
    if here > 1:
        words.append(_between(run, packed, head["interval"]))
    if flashes and len(flashes.time):
        words.append(f"Flashes mark the hardest impacts, which dissipate {quantity(flashes.least, 'J')} and more.")
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


def _between(run, packed, interval):
    text = f"Frames are {interval * 1e3:.4g} ms apart"
    facts = []
    if not run.unsampled:
        rates = {kind: float(run.statistic(f"impacts/{kind}/rate")) for kind in run.kinds}
        rate = sum(rates.values()) + rates["ball_ball"]  # each of these impacts belongs to two balls
        many = rate * interval / len(run.balls("diameter"))
        facts.append(f"a ball has {_plain(many)} impact{'s' * (_plain(many) != '1')}")
    if run.driven == "rotor":
        turn = interval / run.period
        angle = f"{360 * turn:.3g}°" if turn < 1.5 else f"{_plain(turn)} turns"
        facts.append(f"the rotor turns by {angle}")
    elif np.isfinite(run.period):
        share = interval / run.period
        facts.append(f"{_plain(share)} of a period of the slowest motion passes")
    if facts:
        text += f"; from one to the next {' and '.join(facts)}"
    text += ". They come from running the deck again" * isinstance(run, Finer)
    if not packed.close:
        return text + ". Nothing is drawn between them: they are too far apart."
    known = 1 - _unknown(run)
    return (
        f"{text}. Between them a ball flies on parabolas if it has at most one impact ({100 * known:.0f} % of the "
        "flights), else on a smooth curve."
    )


def _unknown(run) -> float:
    """The share of flights between two frames with more than one impact."""
    last, bounds = len(run.frame_times()) - 1, trajectory.Bounds(run)
    first = np.unique(np.linspace(0, last - 1, PAIRS).astype(int))
    pairs = [(trajectory.stored(run, int(k)), trajectory.stored(run, int(k) + 1)) for k in first]
    return float(np.mean([trajectory.Flights(*pair, bounds).unknown for pair in pairs]))


def _plain(value: float) -> str:
    """A number with two significant digits, never as a power of ten."""
    return f"{float(f'{value:.2g}'):,.10g}".replace(",", " ")


def _ordinal(n: int) -> str:
    ending = "th" if n % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(n % 10, "th")
    return f"{n}{ending}"
