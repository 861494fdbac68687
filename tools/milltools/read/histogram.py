"""Histograms of impacts by speed or by energy from an output file, and the number of impacts above any value."""

import dataclasses

import numpy as np

from milltools.base.errors import UserError

ENERGIES = ("normal_energy", "total_energy", "dissipated_energy")


@dataclasses.dataclass(frozen=True)
class Histogram:
    """Impacts by speed or energy: `edges` [m/s] or [J] (n + 1,), `count` (n,), `dissipation` [J] (n,; NaN if not
    known), and the count and dissipation below and above the bins. `part`: "all" if the dissipation is the whole loss,
    "normal" if the program knows only the normal part for each impact."""

    edges: np.ndarray
    count: np.ndarray
    dissipation: np.ndarray
    underflow: float
    overflow: float
    part: str
    dissipation_underflow: float = 0.0
    dissipation_overflow: float = 0.0

    def above(self, speed: float) -> float:
        """Number of impacts at or above a speed [m/s] or energy [J]: exact at an edge, interpolated log-linearly within
        a bin; below the first edge the number of all impacts."""
        upper = np.searchsorted(self.edges, speed * (1 - 1e-9), side="left")  # first edge at or above
        if upper >= len(self.edges):
            return float(self.overflow)
        total = float(self.count[upper:].sum()) + float(self.overflow)
        if speed < self.edges[0] * (1 - 1e-9):
            return total + float(self.underflow)
        if upper > 0 and self.edges[upper] > speed * (1 + 1e-9):
            low, high = np.log(self.edges[upper - 1 : upper + 1])
            total += float(self.count[upper - 1]) * (high - np.log(speed)) / (high - low)
        return total


def by_speed(run, path: str) -> Histogram:
    """The histogram in the group `path` of an open Run."""
    count, dissipation = f"{path}/count", f"{path}/dissipation"
    return Histogram(
        run.read(f"{path}/edges"),
        run.read(count),
        run.read(dissipation),
        *(float(run.attribute(count, side, 0)) for side in ("underflow", "overflow")),
        run.attribute(dissipation, "part", "all"),
        *(float(run.attribute(dissipation, side, 0)) for side in ("underflow", "overflow")),
    )


def by_energy(run, row: str, group: str, name: str, species) -> Histogram:
    """name: "normal", "total" or "dissipated"; the other arguments as in Run.histogram."""
    if group != "impacts":
        raise UserError(f"{run.path}: the file has energies of impacts only, not of {group}")
    names = [] if species is None else [species] if isinstance(species, str) else list(species)
    known = run.species_names()
    for word in names:
        if word not in known:
            raise UserError(f"{run.path}: unknown species '{word}': one of {', '.join(known)}")
    chosen = sorted(run.class_of[known.index(word)] for word in names)
    for word in names:
        also = [one for one, of in zip(known, run.class_of) if of == run.class_of[known.index(word)] and one != word]
        if also:
            raise UserError(f"{run.path}: the impacts of '{word}' are counted together with those of {', '.join(also)}")
    if len(chosen) > 2 or (len(chosen) == 2 and row != "ball_ball"):
        raise UserError(f"{run.path}: give one species, or two with the kind 'ball_ball'")
    kinds = run.kinds if row == "all" else (row,)

    def total(what):
        """The sum over the kinds and over the chosen species."""
        return sum(_of_pairs(run, f"{kind}/{what}", chosen) for kind in kinds)

    count = total(name)
    lost = total("dissipation") if name == "normal" else np.full(len(count), np.nan)
    edges = run.read("statistics/energies/edges")[1:-1]
    outside = (float(values[k]) for values in (count, lost) for k in (0, -1))
    below, above, lost_below, lost_above = outside
    part = run.attribute(f"statistics/energies/{kinds[0]}/dissipation", "part", "all")
    return Histogram(edges, count[1:-1], lost[1:-1], below, above, part, lost_below, lost_above)


def _of_pairs(run, path: str, species: list[int]) -> np.ndarray:
    values = run.read(f"statistics/energies/{path}", why="an older version or another program wrote the file")
    if not species:
        return values.sum(axis=tuple(range(values.ndim - 1)))
    if len(species) == 1 and values.ndim == 3:  # ball-ball: with every species, but with itself only once
        (one,) = species
        return values[one].sum(axis=0) + values[:, one].sum(axis=0) - values[one, one]
    return values[tuple(species)]
