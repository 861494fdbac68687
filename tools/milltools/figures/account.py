"""The energy account of a window: where power comes from and where it goes, from the time series (docs/file-format.md,
/observables). In every row

    work of all that moves = change of the energies + dissipation,

so differences of two rows over the time between balance to rounding; what is left over is the balance error.
"""

import dataclasses

import numpy as np

ENERGIES = {
    "kinetic_energy": "kinetic energy",
    "rotational_energy": "rotational energy",
    "potential_energy": "potential energy",
    "elastic_energy": "elastic energy",
}
NOTHING = 1e-12  # of the turnover: a flow below it is rounding


@dataclasses.dataclass(frozen=True)
class Account:
    """Mean powers [W] between two times (from, to) [s]: of the `drives` on the balls by name, into the
    `energies` by name (> 0: it grows), and `dissipation` by kind: (normal, tangential), tangential None where only the sum
    is known, which then stands first."""

    window: tuple[float, float]
    drives: dict[str, float]
    energies: dict[str, float]
    dissipation: dict[str, tuple[float, float | None]]

    @property
    def lost(self) -> float:
        """All that is dissipated [W]."""
        return sum(a + (b or 0.0) for a, b in self.dissipation.values())

    @property
    def residual(self) -> float:
        """What came in and went nowhere [W]: the balance error."""
        return sum(self.drives.values()) - sum(self.energies.values()) - self.lost

    @property
    def turnover(self) -> float:
        """All that the sources give [W]: 100 %."""
        return sum(power for *_, power in self.sources)

    @property
    def sources(self) -> list[tuple[str, str, str, float]]:
        """(what, kind, part, power > 0 [W]) of everything that gives."""
        return [term for term in self._signed() if term[3] > 0]

    @property
    def sinks(self) -> list[tuple[str, str, str, float]]:
        """The same of everything that takes."""
        return [(*what, -power) for *what, power in self._signed() if power < 0]

    def _signed(self):
        """(what, kind or "", part or "", power: > 0 it gives, < 0 it takes), without what is mere rounding."""
        terms = [
            ("rotor", "", "", p) if name == "rotor" else ("motion", name, "", p) for name, p in self.drives.items()
        ]
        for kind, (normal, tangential) in self.dissipation.items():
            parts = {"": normal} if tangential is None else {"normal": normal, "tangential": tangential}
            terms += [("dissipation", kind, part, -power) for part, power in parts.items()]
        terms += [(name, "", "", -power) for name, power in self.energies.items()]
        terms.append(("residual", "", "", -self.residual))
        most = max(abs(power) for *_, power in terms)
        return [term for term in terms if abs(term[3]) > NOTHING * most]


def why_not(run) -> str | None:
    """Why there is no account of the sampled window; None if there is."""
    for name in ("rotor_work", "kinetic_energy", *(f"dissipation/{k}" for k in run.kinds)):
        if not run.has_series(name):
            return f"the file has no series /observables/{name}"
        if not np.isfinite(run.series(name)[1]).all():
            return f"the run does not tell its {name.replace('_', ' ')}"
    begin, end = window(run)
    if not end > begin:
        return "no two rows of the time series lie in the sampled window (output.series)"
    return None


def window(run) -> tuple[float, float]:
    """The sampled window as far as there are rows of the time series [s]."""
    time = run.series("rotor_work")[0]
    begin, end = run.window
    if not len(time):
        return begin, begin
    return max(begin, float(time[0])), min(end, float(time[-1]))


def account(run) -> Account:
    """Of the sampled window; between rows of the series they are taken as straight."""
    begin, end = window(run)

    def power(name):
        if not run.has_series(name):
            return 0.0
        time, value = run.series(name)
        low, high = np.interp([begin, end], time, value)
        return float(high - low) / (end - begin)

    energies = {name: power(name) for name in ENERGIES if run.has_series(name)}
    energies = {name: value for name, value in energies.items() if np.isfinite(value)}
    dissipation = {}
    for kind in run.kinds:
        total, normal = power(f"dissipation/{kind}"), np.nan
        if run.has_series(f"dissipation_normal/{kind}"):
            normal = power(f"dissipation_normal/{kind}")
        known = np.isfinite(normal)
        dissipation[kind] = (normal, total - normal) if known else (total, None)
    drives = {n: power(f"motion_work/{n}") for n in run.motions if run.has_series(f"motion_work/{n}")}
    if not drives and run.has_rotor:
        drives = {"rotor": power("rotor_work")}
    return Account((begin, end), drives, energies, dissipation)
