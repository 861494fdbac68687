"""The results of a run, for scripts and notebooks."""

from __future__ import annotations

import functools
import os
import pathlib
import shutil
import weakref
from typing import TYPE_CHECKING, Any

from milltools.api import words as show
from milltools.api.measurement import Measurement
from milltools.base.errors import InputError
from milltools.read import deck_text, motions, runfile
from milltools.read.histogram import ENERGIES, Histogram
from milltools.read.runfile import MEDIAN, SUMMARY, Run

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from milltools.api.impacts import Impacts
    from milltools.api.plots import EmbeddedPage

Species = str | tuple[str, str] | None
ARRAYS = ("series", "frames", "maps")  # kept after the first use


def _table(rows: Any, units: dict[str, str], index: Any = None, name: str | None = None) -> pandas.DataFrame:
    import pandas as pd

    table = pd.DataFrame(rows, columns=list(units), index=None if index is None else pd.Index(index, name=name))
    table.attrs["units"] = units
    return table


def load(path: str | os.PathLike[str]) -> Result:
    """Opens the output file of a run, of millsim or of another program in its schema. Data are read only when used, so
    large files open at once. MissingFileError if the file does not exist, InputError if it is not a run."""
    return Result(path)


class Result:
    """One run: `milltools.run(...)` and `milltools.load(path)` give it. A context manager, or use close().

    All values are in SI; values from the file are exactly those of the file. Numbers and tables are read again at each
    use. If data are not in the file, the InputError says which setting would store them.
    """

    def __init__(self, path: str | os.PathLike[str], _folder: pathlib.Path | None = None) -> None:
        self.file = Run(os.fspath(path))  # the underlying reader: milltools.read.runfile.Run
        # a temporary folder exists as long as this object
        self._clear = _folder and weakref.finalize(self, shutil.rmtree, _folder, ignore_errors=True)

    def __enter__(self) -> Result:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file; a temporary file is removed."""
        for name in ARRAYS:
            self.__dict__.pop(name, None)
        self.file.close()
        if self._clear:
            self._clear()

    def __repr__(self) -> str:
        return f"<run {self.name}, closed>" if self.file.closed else show.as_text(self)

    def _repr_html_(self) -> str | None:
        return None if self.file.closed else show.as_html(self)

    # ---- file, status, time

    @property
    def path(self) -> pathlib.Path:
        """The file."""
        return pathlib.Path(self.file.path)

    @property
    def name(self) -> str:
        """The path of the file as given; for a temporary file only its name."""
        return f"{self.path.stem} (temporary)" if self._clear else self.file.path

    @property
    def status(self) -> str:
        """complete, stopped, failed or running."""
        return self.file.status

    @property
    def time(self) -> float:
        """Simulated time reached [s]."""
        return self.file.time

    @property
    def window(self) -> tuple[float, float]:
        """Sampled window (from, to) [s]."""
        return self.file.window

    @property
    def deck(self) -> dict[str, dict[str, str]]:
        """The deck as run, {section: {key: text}}, with all defaults, in SI. It is a plain copy: you can change it and
        use `milltools.run(deck)`, or store it with `milltools.write_deck(deck, "mine.ini")`."""
        return deck_text.sections(self.file.deck_text(), "deck")

    # ---- numbers

    def _measured(self, path: str) -> Measurement:
        self.file.need_statistics()
        value = float(self.file.statistic(path))
        unit = self.file.attribute(f"statistics/{path}", "unit", "")
        return Measurement(value, self.file.standard_error(path), unit)

    @property
    def drive(self) -> Measurement:
        """Mean power of all moving bodies, rotor or other motions, over the window [W]; error as for power."""
        self.file.need_statistics()  # also checks that the file is open
        return self._measured(f"{self.file.drive}/power")

    @property
    def motions(self) -> pandas.DataFrame:
        """One row per motion, including the rotor; columns power, power_error [W], torque, torque_error [N m] (about
        its axis, on the balls; value +- 1.96 errors is the 95 % interval), and a description of the motion."""
        run, rows = self.file, []
        run.need_statistics()
        for name in run.motions:
            known = run.has(f"statistics/motions/{name}/power")
            place = f"motions/{name}" if known else "rotor"  # older files, without motions, have only the rotor's
            paths = [f"{place}/power", f"{place}/torque"]
            pairs = [(float(run.statistic(path)), run.standard_error(path)) for path in paths]
            rows.append((*pairs[0], *pairs[1], motions.words(run, name)))
        units = {"power": "W", "power_error": "W", "torque": "N m", "torque_error": "N m", "words": ""}
        return _table(rows, units, run.motions, "motion")

    @property
    def power(self) -> Measurement:
        """Mean power of the rotor, or of all motions together, over the window [W] with its standard error: value +-
        1.96 errors is the 95 % interval. The error is NaN if the window is too short, in any case with fewer than
        three revolutions."""
        return self.drive

    @property
    def power_models(self) -> pandas.DataFrame:
        """The power of a horizontal drum by the field's formulas, one per row (docs/tumbling.md); columns value [W],
        ratio (simulated power / value), ratio_error, basis (where the power is taken), outside (in which respects the
        mill is out of the formula's range), source. InputError for other mills."""
        from milltools.power import drum

        run = self.file
        rows = drum.rows(drum.mill_of(run.as_deck), drum.simulated(run))
        units = {"value": "W", "ratio": "1", "ratio_error": "1", "basis": "", "outside": "", "source": ""}
        return _table([[row[name] for name in units] for row in rows], units, [row["model"] for row in rows], "model")

    @property
    def torque(self) -> Measurement:
        """Mean torque of the rotor on the balls about +x [N m]; error as for power."""
        return self._measured("rotor/torque")

    @property
    def median_impact_speed(self) -> Measurement:
        """Median normal speed [m/s] of the impacts that do not depend on the rebound floor; error as for power."""
        return self._measured(MEDIAN)

    def read(self, path: str, index: Any = ()) -> Any:
        """Any dataset of the file by its path (docs/file-format.md), or its part `index`:
        result.read("run/version")."""
        return self.file.read(path.strip("/"), index)

    # ---- tables and arrays

    @property
    def summary(self) -> pandas.DataFrame:
        """One row per contact kind and "all"; columns count, rate [1/s], dissipated_power [W], mean, median and
        median_above_floor of the normal speed [m/s], floor_share. `attrs["units"]` names the units."""
        run = self.file
        run.need_statistics()
        units = {name: run.attribute(f"statistics/{path.format('all')}", "unit") for name, path in SUMMARY.items()}
        return _table(run.summary(), units, (*run.kinds, "all"), "kind")

    @property
    def estimates(self) -> pandas.DataFrame:
        """All values of the file that have a standard error, one per row: rotor_power, rotor_torque, median,
        median_above_floor, rate/KIND, rate_above_0.5/KIND, rate_above_1/KIND, rate_above_2/KIND, KIND also "all";
        hard_rate and hard_per_joule (of the drive's work);
        columns value, error (value +- 1.96 errors is the 95 % interval; NaN: not known), degrees_of_freedom,
        unit."""
        run, found = self.file, {}
        run.need_statistics()
        for name, (group, _) in runfile.estimates(run.kinds).items():
            known = run.known(name)
            if known and (run.has_rotor or not name.startswith("rotor_")):
                found[name] = *known, run.attribute(f"statistics/precision/{group}/value", "unit")
        units = {"value": "as in unit", "error": "as in unit", "degrees_of_freedom": "1", "unit": ""}
        return _table(list(found.values()), units, list(found), "name")

    @property
    def charge(self) -> pandas.DataFrame:
        """The charge of a tumbling mill (docs/tumbling.md): one row for toe, shoulder, repose [rad], in_flight [1], and
        mass_across, mass_up, circulation_across, circulation_up [m]; columns value, error and unit. Without rows for
        another mill. `series` has them over time, of the first start, as charge_toe, ... (turn)."""
        run = self.file
        run.need_statistics()
        found = {
            name: (*known, run.attribute(f"statistics/charge/{name}/value", "unit"))
            for name, known in run.charge.items()
        }
        return _table(
            list(found.values()), {"value": "as in unit", "error": "as in unit", "unit": ""}, list(found), "name"
        )

    def spectrum(
        self, kind: str = "all", *, group: str = "impacts", speed: str = "normal_speed", species: Species = None
    ) -> pandas.DataFrame:
        """Impacts of a kind (or "all") by speed: 1140 rows, one bin each, 2 % wide; columns low, high [m/s], count,
        dissipation [J], and per second of the window rate [1/s], power [W].

        group: "impacts", or "strikes" (re-contacts merged); speed: "normal_speed" or "tangential_speed". For impacts
        also "normal_energy", "total_energy" or "dissipated_energy": 1024 rows, low and high [J], 3 to 6 % wide
        (dissipation only with normal energy); then species="steel" selects one species, ("steel", "glass") one pair
        of species.
        """
        histogram, duration = self._histogram(kind, group, speed, species), self.file.duration
        edge = "J" if speed in ENERGIES else "m s-1"
        found = {
            "low": histogram.edges[:-1],
            "high": histogram.edges[1:],
            "count": histogram.count,
            "dissipation": histogram.dissipation,
            "rate": histogram.count / duration,
            "power": histogram.dissipation / duration,
        }
        return _table(found, dict(zip(found, (edge, edge, "1", "J", "s-1", "W"))))

    def rate(
        self, above: float, kind: str = "all", *,
        group: str = "impacts", speed: str = "normal_speed", species: Species = None,
    ) -> float:  # fmt: skip
        """Impacts a second [1/s] at or above a speed [m/s], or an energy [J] with speed="normal_energy", "total_energy"
        or "dissipated_energy"; exact at an edge of a bin, else within its width. Other arguments as for spectrum()."""
        return self._histogram(kind, group, speed, species).above(above) / self.file.duration

    def _histogram(self, kind: str, group: str, speed: str, species: Species) -> Histogram:
        run, speeds = self.file, ("normal_speed", "tangential_speed", *ENERGIES)
        for given, known in ((kind, (*run.kinds, "all")), (group, ("impacts", "strikes")), (speed, speeds)):
            if given not in known:
                raise InputError(f"unknown {given!r}: one of {', '.join(known)}")
        run.need_statistics()
        return run.histogram(kind, group, speed, species)

    @property
    def impacts(self) -> Impacts:
        """The log of single impacts: [first:last] and chunks() read it as DataFrames. InputError if it was not stored,
        which needs `output.impacts = all`."""
        from milltools.api.impacts import Impacts

        return Impacts(self.file)

    @functools.cached_property
    def series(self) -> xarray.Dataset:
        """Time series, lazy: kinetic_energy, rotational_energy, potential_energy, rotor_work [J], rotor_torque [N m]
        (time,), and dissipation, dissipation_normal [J], collisions (time, kind), fast_collisions (time, kind,
        threshold). Works, losses and counts are cumulative from t = 0."""
        from milltools.api import arrays

        return arrays.series(self.file)

    @functools.cached_property
    def frames(self) -> xarray.Dataset:
        """Ball states, lazy: position [m], velocity [m/s], angular_velocity [rad/s], each (time, ball, axis) in single
        precision, with mass [kg], diameter [m] and species of each ball. Only what is selected is read;
        `.chunk({"time": 10})` makes dask arrays. InputError if none are stored (`output.frames = 0 s`)."""
        from milltools.api import arrays

        return arrays.frames(self.file)

    @functools.cached_property
    def maps(self) -> xarray.DataTree:
        """Maps of the window, lazy: nodes cross_section (y, z) and axial (x, r), each with impact_count,
        normal_speed_sum [m/s], dissipation [J], solid_fraction and mean velocities [m/s]; also the edges of
        the cells."""
        from milltools.api import arrays

        return arrays.maps(self.file)

    # ---- figures

    @property
    def figures(self) -> dict[str, str]:
        """The figures that `plot` can draw for this run: {name: title}."""
        from milltools.figures import FIGURES

        return {name: figure.title for name, figure in FIGURES.items() if figure.why_not(self.file) is None}

    def plot(self, name: str, *others: Result, **options: Any) -> Figure:
        """A figure of `mill plot --figure` by its name, such as "section-power"; `figures` has the names. With
        `others` it shows several runs. It has no window of pyplot: a notebook shows it, savefig() writes it."""
        from milltools.api.plots import shown_inline
        from milltools.figures import FIGURES

        if name not in FIGURES:
            raise InputError(f"unknown figure '{name}': one of {', '.join(FIGURES)}")
        shown_inline()
        return FIGURES[name].draw([self.file, *(other.file for other in others)], **options)

    def plot_spectrum(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Draws the impact spectra into axes, new ones by default, and returns them. Options: group, speed, abscissa
        ("speed" or "energy"), weight ("count", "energy" or "cumulative"), kinds; for several runs in the same axes
        name, and position, the number of the run from 0, which sets the colour (milltools.figures.spectra.plot)."""
        from milltools.api import plots

        return plots.spectrum(self.file, ax, options)

    def show(
        self, path: str | os.PathLike[str] | None = None, *, browser: bool = False, height: int = 640
    ) -> EmbeddedPage | pathlib.Path:
        """The moving balls in the mill, as in `mill report`. In a notebook: `height` pixels high and stored in it (up
        to about 7 MB). With a `path` the page is written there and replaces an old file; with `browser` the page, by
        default a temporary file, is opened in a browser. In both cases the path is returned."""
        from milltools.api import plots

        return plots.show(self.file, self.name, path, browser, height)
