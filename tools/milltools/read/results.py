"""The results of a run in a compact form that answers questions after its file is gone: every scalar of /statistics
with its error, and the spectra of impacts by speed and energy.

    kept = Results.of(run)            # of an open Run
    text = kept.pack()                # 12 kB for the reference mill
    Results.unpack(text).above(1e-3, "J", "ball_ball")
"""

import base64
import json
import math
import zlib

import h5py
import numpy as np

from milltools.base.errors import UserError
from milltools.read.histogram import Histogram
from milltools.read.runfile import PRECISION, RATE, THRESHOLDS, Run, estimates

NO_SCALARS = ("maps", "energies", "histogram")
SPECTRA = {"m/s": "normal_speed", "J": "normal_energy"}
# edges of bins by their first and last edge and their number: only these three numbers are kept
LAWS = {
    "log": np.geomspace,
    "sixteenths": lambda low, high, count: low * (2.0 ** (np.arange(count) // 16)) * (1 + np.arange(count) % 16 / 16),
}


class Results:
    """`data`, JSON-able: "duration" [s]; "mass" of all balls [kg]; "scalars" {unit: {path below /statistics: [value,
    standard error or None]}}; "known" {kind: [[rate [1/s], standard error], ...]} of impacts above some speeds;
    "bins" {"m/s" or "J": edges as LAWS}; "counts" {"m/s" or "J": {kind: [below, first, counts ..., above]}}, where
    `first` is the number of the first bin with a count."""

    def __init__(self, data: dict):
        self.data = data
        self.units = {path: unit for unit, group in data["scalars"].items() for path in group}

    # ---- from a run, to and from text

    @classmethod
    def of(cls, run: Run) -> "Results":
        scalars = {}

        def note(group, prefix):
            for name, item in group.items():
                path = prefix + name
                if isinstance(item, h5py.Group):
                    if name not in NO_SCALARS:
                        note(item, f"{path}/")
                elif item.shape in ((), (1,)) and item.dtype.kind in "fiu":
                    told = path in PRECISION or RATE.fullmatch(path) or f"{name}_error" in group
                    error = run.standard_error(path) if told else math.nan
                    unit = item.attrs.get("unit", "")
                    own = scalars.setdefault(unit.decode() if isinstance(unit, bytes) else str(unit), {})
                    own[path] = [float(np.ravel(item[()])[0]), error if math.isfinite(error) else None]

        run.need_statistics()
        note(run.find("statistics"), "")
        kinds = (*run.kinds, "all")
        found = [name for name in estimates(run.kinds) if name.startswith("rate")]
        known = {kind: [] for kind in kinds}
        for name in found:
            if told := run.known(name):
                known[name.partition("/")[2]].append([*told[:2]])
        data = {"duration": run.duration, "mass": run.as_deck.mass, "scalars": scalars, "known": known}
        data |= {"bins": {}, "counts": {}}
        for unit, name in SPECTRA.items():
            try:
                spectra = {kind: run.histogram(kind, speed=name) for kind in kinds}
            except UserError:  # an older version or another program wrote the file
                continue
            data["bins"][unit] = _law(spectra["all"].edges)
            data["counts"][unit] = {kind: _sparse(spectrum) for kind, spectrum in spectra.items()}
        return cls(data)

    def pack(self) -> str:
        return base64.b64encode(zlib.compress(json.dumps(self.data, separators=(",", ":")).encode(), 9)).decode()

    @classmethod
    def unpack(cls, text: str) -> "Results | None":
        """None for a run without results, or of an earlier version."""
        try:
            return cls(json.loads(zlib.decompress(base64.b64decode(text)))) if text else None
        except (ValueError, KeyError, AttributeError, zlib.error):
            return None

    # ---- numbers

    @property
    def kinds(self) -> list[str]:
        return list(self.data["known"])

    def scalar(self, path: str) -> tuple[float, float]:
        """Value and standard error (NaN if not known) of a path below /statistics; KeyError if there is none."""
        value, error = self.data["scalars"][self.units[path]][path]
        return value, math.nan if error is None else error

    def above(self, limit: float, unit: str, kind: str) -> tuple[float, float]:
        """Rate of impacts [1/s] of a kind above a normal speed ("m/s") or a normal energy ("J"), and its standard
        error. UserError without these spectra."""
        if unit not in self.data["counts"]:
            raise UserError(f"no spectra by {'energy' if unit == 'J' else 'speed'} are kept of this run")
        below, first, *counts, above = self.data["counts"][unit][kind]
        bins, edges = np.array(counts, float), _edges(self.data["bins"][unit])
        edges = edges[first : first + len(bins) + 1]
        some = Histogram(edges, bins, bins, below, above, "all")
        duration = self.data["duration"]
        rate = some.above(limit) / duration if duration > 0 else math.nan
        known = self.data["known"][kind]
        if unit == "m/s" and len(known) > len(THRESHOLDS) and limit in THRESHOLDS:
            return rate, known[1 + THRESHOLDS.index(limit)][1]
        exact = "precision/rate_above_1mJ/standard_error"
        if unit == "J" and limit == 1e-3 and kind == "all" and exact in self.units:
            return rate, self.scalar(exact)[0]
        return rate, self._tail_error(rate, kind)

    def _tail_error(self, rate: float, kind: str) -> float:
        """Standard error of a rate above any limit: the relative error of the known rate of this kind that is nearest
        to it (above 0, 0.5, 1 or 2 m/s), at least that of counting."""
        known = [(r, e) for r, e in self.data["known"][kind] if r > 0 and e is not None and math.isfinite(e)]
        if not rate > 0 or not known:
            return math.nan
        near, error = min(known, key=lambda one: abs(math.log(one[0] / rate)))
        return rate * max(error / near, 1 / math.sqrt(rate * self.data["duration"]))


def _sparse(spectrum) -> list:
    filled = np.flatnonzero(spectrum.count)
    first, last = (int(filled[0]), int(filled[-1]) + 1) if len(filled) else (0, 1)
    return [spectrum.underflow, first, *map(int, spectrum.count[first:last]), spectrum.overflow]


def _law(edges) -> list:
    ends = float(edges[0]), float(edges[-1]), len(edges)
    for name, law in LAWS.items():
        if np.allclose(law(*ends), edges, rtol=1e-12, atol=0):
            return [name, *ends]
    return edges.tolist()


def _edges(told: list) -> np.ndarray:
    return LAWS[told[0]](*told[1:]) if isinstance(told[0], str) else np.array(told)
