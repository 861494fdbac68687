"""The results of a run in a compact form that answers questions after its file is gone: every scalar of /statistics
with its error, and the spectra of impacts by speed and energy.

    kept = Results.of(run)            # of an open Run
    text = kept.pack()                # 20 kB for the reference mill
    Results.unpack(text).above(1e-3, "J", "ball_ball")
"""

import base64
import json
import math
import zlib

import h5py
import numpy as np

from milltools.base.errors import UserError
from milltools.read import sums
from milltools.read.histogram import Histogram
from milltools.read.runfile import PRECISION, RATE, THRESHOLDS, Run, estimates

NO_SCALARS = ("maps", "energies", "histogram")
DRIVES = ("drive/power", "rotor/power")
LOST = (*DRIVES, "impacts/all/dissipated_power", "dose/power", "dose/dose_rate", "dose/dose_in_an_hour")
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
    `first` is the number of the first bin with a count; "blocks": {"period", "starts": of sums.standard_error, "counts"
    {kind: impacts (octaves of energy, blocks)}, "lost" {kind: power lost in each block, in units of 1e-4 of the mean of
    all}}, without it if the file has none; "without" {"dose" or "wear": why there are no such scalars}."""

    def __init__(self, data: dict):
        self.data = data
        self.blocks = data.get("blocks")
        self.units = {path: unit for unit, group in data["scalars"].items() for path in group}

    # ---- from a run, to and from text

    @classmethod
    def of(cls, run: Run, *more) -> "Results":
        """`more`: functions of the run such as dose.scalars, each with the name of its scalars, that give {path:
        (value, standard error, unit)} in addition; a UserError of theirs is kept as the reason."""
        scalars, without = {}, {}

        def note(group, prefix):
            for name, item in group.items():
                path = prefix + name
                if isinstance(item, h5py.Group):
                    if name not in NO_SCALARS:
                        note(item, f"{path}/")
                elif item.shape in ((), (1,)) and item.dtype.kind in "fiu":
                    told = path in PRECISION or RATE.fullmatch(path) or f"{name}_error" in group
                    told = told or prefix.startswith("charge/")
                    error = run.standard_error(path) if told else math.nan
                    unit = item.attrs.get("unit", "")
                    own = scalars.setdefault(unit.decode() if isinstance(unit, bytes) else str(unit), {})
                    own[path] = [float(np.ravel(item[()])[0]), error if math.isfinite(error) else None]

        run.need_statistics()
        note(run.find("statistics"), "")
        for name, tell in more:
            try:
                for path, (value, error, unit) in tell(run).items():
                    told = [value if math.isfinite(value) else None, error if math.isfinite(error) else None]
                    scalars.setdefault(unit, {})[path] = told
            except UserError as fault:
                without[name] = str(fault).removeprefix(f"{run.path}: ")
        kinds = (*run.kinds, "all")
        found = [name for name in estimates(run.kinds) if "/" in name and name.startswith("rate")]
        known = {kind: [] for kind in kinds}
        for name in found:
            if told := run.known(name):
                known[name.partition("/")[2]].append([*told[:2]])
        data = {"duration": run.duration, "mass": run.as_deck.mass, "scalars": scalars, "known": known}
        data |= {"without": without} if without else {}
        data |= {"bins": {}, "counts": {}}
        for unit, name in SPECTRA.items():
            try:
                spectra = {kind: run.histogram(kind, speed=name) for kind in kinds}
            except UserError:  # an older version or another program wrote the file
                continue
            data["bins"][unit] = _law(spectra["all"].edges)
            data["counts"][unit] = {kind: _sparse(spectrum) for kind, spectrum in spectra.items()}
        if sums.has_errors(run):
            data["blocks"] = _blocks(run)
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
        return tuple(math.nan if one is None else one for one in (value, error))

    def above(self, limit: float, unit: str, kind: str) -> tuple[float, float, np.ndarray | None]:
        """Rate of impacts [1/s] of a kind above a normal speed ("m/s") or a normal energy ("J"), its standard error,
        and the impacts in each block of time, as history() gives them. UserError without these spectra."""
        if unit not in self.data["counts"]:
            raise UserError(f"no spectra by {'energy' if unit == 'J' else 'speed'} are kept of this run")
        below, first, *counts, above = self.data["counts"][unit][kind]
        bins, edges = np.array(counts, float), _edges(self.data["bins"][unit])
        edges = edges[first : first + len(bins) + 1]
        count = Histogram(edges, bins, bins, below, above, "all").above(limit)
        duration, known = self.data["duration"], self.data["known"][kind]
        rate = count / duration if duration > 0 else math.nan
        series = self._tail(kind, count)
        if unit == "m/s" and len(known) > len(THRESHOLDS) and limit in THRESHOLDS:
            error = known[1 + THRESHOLDS.index(limit)][1]
        elif series is None or count < sums.SEEN or sums.few_saw(series, self.period):
            error = math.nan
        else:
            found = sums.standard_error(rate * series / series.mean(), self.period, self.starts)
            error = max(found, rate / math.sqrt(count)) if math.isfinite(found) else math.nan
        return rate, error, series

    # ---- blocks of time

    @property
    def period(self) -> int:
        return self.blocks["period"] if self.blocks else 0

    @property
    def starts(self) -> int:
        """Of how many starts the blocks are, one after the other."""
        return self.blocks.get("starts", 1) if self.blocks else 1

    def _tails(self, kind: str) -> list[np.ndarray]:
        """Impacts above each power of two of energy in each block; the first ones are all impacts."""
        if not self.blocks:
            return []
        own = [self._counts(one) for one in ([kind] if kind != "all" else self.blocks["counts"])]
        tails = np.cumsum(sum(own)[::-1], axis=0)[::-1]
        return [tail for tail in tails if tail.any()]

    def _tail(self, kind: str, count: float) -> np.ndarray | None:
        """The impacts above the power of two of energy that leaves the nearest number of impacts, in each block."""
        near = lambda tail: abs(math.log(tail.sum() / count)) if count > 0 else 0  # noqa: E731
        return min(self._tails(kind), key=near, default=None)

    def _counts(self, kind: str) -> np.ndarray:
        return np.array(self.blocks["counts"][kind], float)

    def history(self, path: str) -> np.ndarray | None:
        """A number below /statistics, but for a factor, in each block of time: of rates, losses, and the power of the
        drive, which the losses follow; None for others and without blocks."""
        group, _, name = path.rpartition("/")
        kind = group.removeprefix("impacts/")
        if self.blocks and path == "dose/hard_impacts":
            return self._tail("all", self.scalar(path)[0] * self.data["duration"])
        if not self.blocks or (path not in LOST and kind not in self.kinds):
            return None
        if name == "rate":
            return next(iter(self._tails(kind)), None)
        lost = self.blocks["lost"]
        if path in LOST:
            return np.sum(list(lost.values()), axis=0)
        return np.array(lost[kind], float) if name == "dissipated_power" else None


def _blocks(run) -> dict:
    counts, lost = {}, {}
    for kind in run.kinds:
        found = run.read(f"{sums.BLOCKS}/{kind}/normal")
        found = found.reshape(len(found), -1, found.shape[-1]).sum(axis=1)  # of all species
        octaves = np.add.reduceat(found, [0, *range(1, found.shape[1], sums.OCTAVE)], axis=1)
        counts[kind] = octaves.T.tolist()
        lost[kind] = sums.total(run, sums.itself, "dissipated", [kind]).series
    mean = sum(series.mean() for series in lost.values()) or 1.0
    lost = {kind: np.rint(1e4 * series / mean).astype(int).tolist() for kind, series in lost.items()}
    return {"period": sums.period(run), "starts": sums.few(run), "counts": counts, "lost": lost}


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
