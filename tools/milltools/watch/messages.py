"""What the page of `mill watch` is told, from the published file of a run: the mill, states, results. All in SI units.

Arrays of numbers are {"f4": base64}, with f4, f8, u1 or u4 for their type; source.js turns them into typed arrays.
"""

import base64
import contextlib
import math

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.geometry.bodies import SAMPLED, Mill, bare
from milltools.geometry.trajectory import stored
from milltools.player.frames import MOST_BALLS

LEFT_OUT = ("maps", "energies", "wear", "histogram")  # groups of /statistics that are no numbers of a summary
NEAR = 1e-6  # of an interval: a time this much before a row of the series is the row's
FORMS = ("kinetic", "rotational", "potential")


def array(values, kind: str) -> dict[str, str]:
    return {kind: base64.b64encode(np.ascontiguousarray(values, f"<{kind}").tobytes()).decode()}


# ---- the mill


def chosen(run) -> np.ndarray:
    """The indices of the balls to draw: at most MOST_BALLS, every k-th."""
    balls = len(run.balls("diameter"))
    return np.arange(0, balls, -(-balls // MOST_BALLS))


def mill(run) -> dict:
    """The message "mill" of a run, also before its first checkpoint: then millsim runs its deck with one ball."""
    period = run.period if math.isfinite(run.period) else 0.0
    whole = run.has("VTKHDF") and len(run.frame_times()) > 0
    with contextlib.nullcontext(run) if whole else bare(run.as_deck, period, SAMPLED) as source:
        head = _head(run, source)
    balls = run.balls("species")
    return {
        "type": "mill",
        "head": head,
        "keys": [_key(run, section, key) for section, keys in run.as_deck.sections.items() for key in keys],
        "deck": run.deck_text(),
        "warnings": run.notes,
        "kinds": list(run.kinds),
        "motions": head["motions"],
        "species": [
            {"name": plain(kind.name), "count": int((balls == k).sum()), "diameter": kind.diameter, "mass": kind.mass}
            for k, kind in enumerate(run.as_deck.species)
        ],
    }


def _head(run, source):
    """What draws the mill; source: a Run of the same mill with its bodies."""
    from milltools.player import player  # matplotlib takes a second; the page is open meanwhile
    from milltools.render import colour

    shape, names, balls = Mill.of(source), list(source.first_poses()), chosen(run)
    up, views = player.views_of(source, 0)
    return {
        "drawn": len(balls),
        "runs": player.runs_of(run.balls("diameter")[balls], run.balls("mass")[balls]),
        "bodies": [
            {
                "look": body["look"],
                "motion": body["motion"],
                "points": array(body["points"], "f4"),
                "corners": array(body["corners"], "u4"),
            }
            for body in player.bodies(shape, names)
        ],
        "edges": {"lines": array(shape.edges, "f4"), "width": shape.rim},
        "motions": names,
        "carrier": names.index(shape.carrier) if shape.carrier in names else -1,
        "poses": array(list(source.first_poses().values()), "f4"),  # at the start
        "slice": run.slice_length,
        "up": up,
        "views": views,
        "hulls": [array(hull, "f4") for hull in (shape.hull, shape.swept(shape.poses[:1]))],
        "gravity": run.vector("gravity/acceleration").tolist(),
        "colours": array(colour.TABLES["speeds"], "u1"),
    }


def _key(run, section, key):
    """A key of the deck, which cannot be changed: so its limits are not told."""
    text, kind, unit = run.text(f"{section}/{key}"), "name", ""
    with contextlib.suppress(UserError, ValueError, IndexError):
        words = text.split()
        float(words[0])
        values = run.as_deck.numbers(f"{section}.{key}")
        kind, unit = ("vector" if len(values) > 1 else "number"), " ".join(words[len(values) :])
    meaning = run.attribute(f"deck/{section}/{key}", "description", "")
    told = {"section": section, "key": key, "value": text, "type": kind, "unit": unit, "words": "", "meaning": meaning}
    return {name: plain(one) for name, one in told.items()} | {"lo": None, "hi": None, "above": 0, "instead": ""}


# ---- states


class Series:
    """The time series of a run at the times of some frames."""

    def __init__(self, run, times):
        self.run, self.times = run, times

    def __call__(self, name) -> np.ndarray | None:
        """The values in the last row at or before each time; None if the run does not have this series."""
        if not self.run.has_series(name):
            return None
        rows = np.floor(self.times / self.run.quantity("output/series") + NEAR).astype(int)
        first, last = int(rows[0]), min(int(rows[-1]) + 1, self.run.length(f"observables/{name}/value"))
        if first >= last:
            return None
        values = self.run.read(f"observables/{name}/value", slice(first, last)).astype(float)
        return values[np.minimum(rows, last - 1) - first]


def states(run, index, kinds, pace) -> list[dict]:
    """The messages "state" of the stored frames `index`, in rising order; kinds: those of mill(); pace: (simulated
    seconds, contacts) per second of elapsed time."""
    if not len(index):
        return []
    balls, times = chosen(run), run.frame_times()[index]
    series = Series(run, times)
    energy = {form: series(f"{form}_energy") for form in FORMS}
    motions = run.poses(int(index[0]))  # in the order of mill()
    work = [series(f"motion_work/{name}") for name in motions]
    lost, hits = ([series(f"{what}/{kind}") for kind in kinds] for what in ("dissipation", "collisions"))

    def at(values, n):
        return None if values is None else float(values[n])

    found = []
    for n, k in enumerate(map(int, index)):
        counts, works = ([at(values, n) for values in some] for some in (hits, work))
        found.append(
            {
                "type": "state",
                "time": float(times[n]),
                "contacts": sum(filter(None, counts)),
                "positions": array(run.frame(k, "position")[balls], "f4"),
                "speeds": array(stored(run, k).speed[balls], "f4"),
                "poses": array(list(run.poses(k).values()), "f4"),
                "factor": pace[0],
                "rate": pace[1],
                "energy": {form: at(values, n) for form, values in energy.items()},
                "work": sum(filter(None, works)),
                "motionWork": works,
                "dissipation": [at(values, n) for values in lost],
                "collisions": counts,
                "ended": False,
            }
        )
    return found


# ---- results


def results(run) -> dict | None:
    """The message "results"; None before the first checkpoint. Besides, `notes`: the lines of /run/notes."""
    if not run.has_statistics:
        return None
    numbers = statistics(run)
    begin = {"sample_from": run.window[0], "settled": int(numbers["precision"].get("settled", 1))}
    return {"type": "results", **begin, "statistics": numbers, "spectrum": spectrum(run), "notes": run.notes}


def statistics(run) -> dict:
    """The group "statistics" of `millsim --json`."""
    found = {"precision": {}}
    for path in run.paths("statistics"):
        _, *groups, name = path.split("/")
        if set(LEFT_OUT).intersection(groups):
            continue
        here = found
        for group in groups:
            here = here.setdefault(group, {})
        here[name] = run.read(path)
        if name == "quantiles":
            found["quantile_levels"] = run.attribute(path, "levels", (0.0,))
    return found


def spectrum(run) -> dict | None:
    """Impacts of the window by normal energy, and what they dissipated: arrays by kind, and of all; None without
    histograms by energy."""
    try:
        spectra = {kind: run.histogram(kind, speed="normal_energy") for kind in run.kinds}
    except UserError:  # a file of an early version, or of another program
        return None
    sums = {"count": {k: one.count for k, one in spectra.items()}}
    sums["dissipation"] = {k: one.dissipation for k, one in spectra.items()}
    for values in sums.values():
        values["all"] = sum(values.values())
    coded = {name: {k: array(v, "f8") for k, v in values.items()} for name, values in sums.items()}
    return {"edges": array(next(iter(spectra.values())).edges, "f8")} | coded
