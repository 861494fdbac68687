"""The energy account as a flow. Sources are the motions and energy that the charge releases. Sinks are the dissipation
by contact kind, divided into its normal and tangential part, and energy that the charge stores. The numbers come from
the time series (docs/file-format.md, /observables). In every row

    work of all motions = change of the energies + dissipation,

so the mean powers between two rows balance except for rounding; the rest is the balance error.
"""

import dataclasses

import numpy as np

from milltools.base.text import literal, number, quantity
from milltools.figures import sankey
from milltools.figures.base import WIDTH, Figure, labels, subtitle
from milltools.figures.style import INK, kind_look
from milltools.read.kinds import label
from milltools.read.runfile import FORMS

PARTS = {"normal": 0.85, "tangential": 0.5, "": 0.7}  # opacity of a band
STORED = "#8c8c8c"
FIRST = "; the first of %d starts, as all time series"
NOTHING = 1e-12  # of the turnover: a smaller flow is rounding


@dataclasses.dataclass(frozen=True)
class Account:
    """Mean powers [W] in a `window` (from, to) [s]: of the `drives` on the balls by name, into the `energies` by name
    (> 0: the energy grows), and `dissipation` by kind: (normal, tangential), or (sum, None) if only the sum is
    known."""

    window: tuple[float, float]
    drives: dict[str, float]
    energies: dict[str, float]
    dissipation: dict[str, tuple[float, float | None]]

    @property
    def residual(self) -> float:
        """The balance error [W]: work minus change of energies minus dissipation."""
        lost = sum(a + (b or 0.0) for a, b in self.dissipation.values())
        return sum(self.drives.values()) - sum(self.energies.values()) - lost

    @property
    def turnover(self) -> float:
        """The sum of all sources [W]: 100 %."""
        return sum(power for *_, power in self.sources)

    @property
    def sources(self) -> list[tuple[str, str, str, float]]:
        """(what, kind or "", part or "", power > 0 [W]) of all sources, without those that are rounding."""
        return self._terms(1)

    @property
    def sinks(self) -> list[tuple[str, str, str, float]]:
        """Like `sources`, for all sinks."""
        return self._terms(-1)

    def _terms(self, sign):
        terms = [
            ("rotor", "", "", p) if name == "rotor" else ("motion", name, "", p) for name, p in self.drives.items()
        ]
        for kind, (normal, tangential) in self.dissipation.items():
            parts = {"": normal} if tangential is None else {"normal": normal, "tangential": tangential}
            terms += [("dissipation", kind, part, -power) for part, power in parts.items()]
        terms += [(name, "", "", -power) for name, power in self.energies.items()]
        terms.append(("residual", "", "", -self.residual))
        least = NOTHING * max(abs(power) for *_, power in terms)
        return [(*what, sign * power) for *what, power in terms if sign * power > least]


def why_no_account(run) -> str | None:
    """Why the account of the sampled window is not known; None if it is."""
    for name in ("kinetic_energy", *(f"dissipation/{k}" for k in run.kinds)):
        if not run.has_series(name):
            return f"the file has no series /observables/{name}"
        if not np.isfinite(run.series(name)[1]).all():
            return f"/observables/{name} contains values that are not numbers"
    begin, end = window(run)
    if not end > begin:
        return "fewer than two rows of the time series are in the sampled window (output.series)"
    return None


def window(run) -> tuple[float, float]:
    """The part of the sampled window that the time series covers [s]."""
    time = run.series("kinetic_energy")[0]
    begin, end = run.window
    if not len(time):
        return begin, begin
    return max(begin, float(time[0])), min(end, float(time[-1]))


def account(run) -> Account:
    """The account of the sampled window; between rows the series are interpolated linearly."""
    begin, end = window(run)

    def power(name, otherwise=0.0):
        if not run.has_series(name):
            return otherwise
        time, value = run.series(name)
        low, high = np.interp([begin, end], time, value)
        return float(high - low) / (end - begin)

    energies = {name: value for name in FORMS if np.isfinite(value := power(name, np.nan))}
    dissipation = {}
    for kind in run.kinds:
        total, normal = power(f"dissipation/{kind}"), power(f"dissipation_normal/{kind}", np.nan)
        dissipation[kind] = (normal, total - normal) if np.isfinite(normal) else (total, None)
    drives = {n: power(f"motion_work/{n}") for n in run.motions if run.has_series(f"motion_work/{n}")}
    if not drives and run.has_rotor:
        drives = {"rotor": power("rotor_work")}
    return Account((begin, end), drives, energies, dissipation)


class Flow(Figure):
    name, group, title = "flow", "energy", "Energy balance"
    caption = (
        "Mean powers over the sampled window, widths true to scale. Left: the sources of energy (each motion; the "
        "charge, if its kinetic or potential energy falls; the rebound floor at slow impacts of hard spheres). Right: "
        "the sinks. The sum of the sources is 100 %."
    )

    def why_not(self, run):
        why = run.unsampled or why_no_account(run)
        if why:
            return why
        return None if account(run).turnover > 0 else "no energy was supplied in the sampled window"

    def says(self, runs):
        if len(runs) == 1:
            return self.caption
        return self.caption.replace("true to scale", "on one scale of watts for all runs").replace(
            "The sum of the sources is 100 %.", "The sum of the sources of a run is its 100 %."
        )

    def paint(self, figure, runs):
        accounts = [account(run) for run in runs]
        rows = max(len(a.sinks) for a in accounts)
        scale = 0.25 + 0.16 * max(rows, 6)  # [inch] of the largest turnover
        axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
        largest = max(found.turnover for found in accounts)
        extents = []
        for ax, run, name, found in zip(axes, runs, labels(runs), accounts):
            extents.append(panel(ax, found, scale, largest))
            subtitle(ax, f"{name}, {_words(found)}{FIRST % run.starts if run.starts > 1 else ''}", 71)
        axes[0].get_gridspec().set_height_ratios(extents)  # so an inch is the same power in all of them
        figure.set_size_inches(WIDTH, 0.35 + sum(0.45 + scale * extent for extent in extents))

    def columns(self, run):
        found = account(run)
        rows = [("gives", *s) for s in found.sources] + [("takes", *s) for s in found.sinks]
        columns = dict(zip(("way", "what", "kind", "part", "power [W]"), map(np.array, zip(*rows))))
        begin, end = (np.full(len(rows), time) for time in found.window)
        return {**columns, "share [1]": columns["power [W]"] / found.turnover, "from [s]": begin, "to [s]": end}


def _words(found: Account) -> str:
    begin, end = found.window
    off = abs(found.residual) / found.turnover
    error = "<0.001 %" if off < 1e-5 else f"{number(100 * off)} %"
    whole = quantity(found.turnover, "W")
    return f"mean of {number(begin, 4)} to {number(end, 4)} s; 100 % = {whole}, balance error {error}"


def panel(ax, found: Account, scale: float, largest: float) -> float:
    """Draws one account into its own axes; the power `largest` [W] is `scale` [inch] high. Returns the height of the
    axes divided by `scale`."""
    kinds = [kind for _, kind, *_ in found.sinks]
    sources = [_band(found, *term, gives=True) for term in found.sources]
    sinks = [_band(found, *term, named=term[1] not in kinds[:k]) for k, term in enumerate(found.sinks)]
    line = 0.168 / scale
    extent = sankey.draw(ax, sources, sinks, line, largest)
    ax.set_axis_off()
    ax.set_xlim(sankey.LEFT, sankey.COLUMNS[-1])
    ax.set_ylim(extent, -line / 2)
    return extent + line / 2


def _band(found: Account, what, kind, part, power, gives=False, named=True) -> sankey.Band:
    """The band of a source or sink; `named` False: the label has no name of the kind, because the band above has it."""
    percent = 100 * power / found.turnover
    numbers = quantity(power, "W"), f"{percent:.1f} %" if percent >= 0.05 else "<0.1 %"
    if what == "dissipation":
        colour, group = kind_look(kind, tuple(found.dissipation))["color"], what if gives else kind
        who = literal(label(kind), 14)
        words = [literal(f"{who} {part}".strip(), 18)] if gives else [who if named else "", part]
    else:
        name = {"motion": literal(kind, 14), "residual": "balance error"}.get(what, what.replace("_", " "))
        way = {"motion": ", braked", "rotor": ", braked", "residual": ""}.get(what, " rises")
        colour, group = INK if gives and what in ("rotor", "motion") else STORED, what
        words = [name] if gives else [name + way, ""]
    return sankey.Band(power, colour, 0.55 if gives else PARTS[part], (*words, *numbers), group)


FIGURES = (Flow(),)
