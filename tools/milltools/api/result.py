"""What a run holds, for scripts and notebooks."""

from __future__ import annotations

import os
import pathlib
import shutil
import weakref
from typing import TYPE_CHECKING

from milltools.api import decks
from milltools.api import words as show
from milltools.api.measurement import Measurement
from milltools.read.runfile import MEDIAN, Run

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from milltools.api.tables import Impacts


def load(path) -> Result:
    """Opens the output file of a run, millsim's or another's in its schema; nothing is read until it is asked for, so a file
    of gigabytes costs nothing. UserError (status 2) if it is not there or no run."""
    return Result(path)


class Result:
    """One run: `milltools.run(...)` and `milltools.load(path)` give it. A context manager; close() does as well.

    All values are in SI and, where the file holds them, those of the file to the last bit. Attributes read anew each time
    they are asked for. What is not in the file is a UserError that says what it would take.
    """

    def __init__(self, path, _folder=None):
        self.file = Run(os.fspath(path))  # the reader below all this: milltools.read.runfile.Run
        # a temporary folder lives as long as this
        self._clear = _folder and weakref.finalize(self, shutil.rmtree, _folder, ignore_errors=True)

    def __enter__(self) -> Result:
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Closes the file; a temporary one goes with it."""
        self.file.close()
        if self._clear:
            self._clear()

    def __repr__(self) -> str:
        return f"<run {self.name}, closed>" if self.file.closed else show.as_text(self)

    def _repr_html_(self) -> str | None:
        return None if self.file.closed else show.as_html(self)

    # ---- who, what, how far

    @property
    def path(self) -> pathlib.Path:
        """The file."""
        return pathlib.Path(self.file.path)

    @property
    def name(self) -> str:
        """The file's path as given; where it is temporary, its name alone."""
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
        """The deck as run, {section: {key: text}}, defaults filled in, SI. A plain dictionary of its own: change it, then
        `milltools.run(deck)`, or keep it with `milltools.write_deck(deck, "mine.ini")`."""
        return decks.sections(self.file.deck_text())

    # ---- numbers

    def _measured(self, path: str) -> Measurement:
        self.file.need_statistics()
        value = float(self.file.statistic(path))
        unit = self.file.attribute(f"statistics/{path}", "unit", "")
        return Measurement(value, self.file.standard_error(path), unit)

    @property
    def drive(self) -> Measurement:
        """Mean power of all that moves, rotor or other motions, over the window [W]; error as of power."""
        self.file.need_statistics()  # asks whether it is open, before the file is asked for more
        return self._measured("rotor/power" if self.file.driven != "drive" else "drive/power")

    @property
    def motions(self) -> pandas.DataFrame:
        """What moves: one row a motion, the rotor too; columns power, power_error [W], torque, torque_error [N m] (about its
        axis, on the balls; value +- 1.96 of the error is the 95 % interval), and in words how it goes."""
        from milltools.api import tables

        return tables.motions(self.file)

    @property
    def power(self) -> Measurement:
        """Mean power of the rotor, or of all motions together, over the window [W] with its standard error: value +- 1.96 of it
        is the 95 % interval; NaN where the window is too short to tell, with fewer than three revolutions at any rate."""
        return self.drive

    @property
    def torque(self) -> Measurement:
        """Mean torque of the rotor on the balls about +x [N m]; error as of power."""
        return self._measured("rotor/torque")

    @property
    def median_impact_speed(self) -> Measurement:
        """Median normal speed of all impacts above 50 mm/s [m/s]; error as of power."""
        return self._measured(MEDIAN)

    def read(self, path: str, index=()):
        """Any dataset of the file by its path (docs/file-format.md), or its part `index`: result.read("run/version")."""
        return self.file.read(path.strip("/"), index)

    # ---- tables and arrays

    @property
    def summary(self) -> pandas.DataFrame:
        """One row a contact kind and "all"; columns count, rate [1/s], dissipated_power [W], mean, median and
        median_above_50mm_s of the normal speed [m/s], floor_share. `attrs["units"]` names the units."""
        from milltools.api import tables

        return tables.summary(self.file)

    @property
    def estimates(self) -> pandas.DataFrame:
        """All that the file knows with a standard error, a row each: rotor_power, rotor_torque, median, median_above_50mm_s,
        rate/KIND, rate_above_0.5/KIND, rate_above_1/KIND, rate_above_2/KIND, with KIND "all", too; columns value, error
        (value +- 1.96 of it is the 95 % interval; NaN: not known), degrees_of_freedom, unit."""
        from milltools.api import tables

        return tables.estimates(self.file)

    def spectrum(self, kind="all", *, group="impacts", speed="normal_speed", species=None) -> pandas.DataFrame:
        """Impacts of a kind (or "all") by speed: 1140 rows, a bin each, 2 % wide; columns low, high [m/s], count,
        dissipation [J], and per second of the window rate [1/s], power [W].

        group: "impacts", or "strikes", re-contacts merged; speed: "normal_speed" or "tangential_speed". Impacts also by
        "normal_energy", "total_energy" or "dissipated_energy": 1024 rows, low and high [J], 3 to 6 % wide (dissipation
        is known by normal energy); then species="steel" or ("steel", "glass") are those of one species, or pair of balls.
        """
        from milltools.api import tables

        return tables.spectrum(self.file, kind, group, speed, species)

    def rate(self, above, kind="all", *, group="impacts", speed="normal_speed", species=None) -> float:
        """Impacts a second [1/s] at or above a speed [m/s], or an energy [J] with speed="normal_energy", "total_energy" or
        "dissipated_energy"; exact at an edge of a bin, else good to its width. Other arguments as of spectrum()."""
        from milltools.api import tables

        return tables.rate(self.file, above, kind, group, speed, species)

    @property
    def impacts(self) -> Impacts:
        """The log of single impacts: [first:last] and chunks() read it as DataFrames. UserError if it was not kept, which
        takes `output.impacts = all`."""
        from milltools.api import tables

        return tables.Impacts(self.file)

    @property
    def series(self) -> xarray.Dataset:
        """Time series, lazy: kinetic_energy, rotational_energy, potential_energy, rotor_work [J], rotor_torque [N m] (time,),
        and dissipation, dissipation_normal [J], collisions (time, kind), fast_collisions (time, kind, threshold). Works,
        losses and counts are cumulative from t = 0."""
        from milltools.api import arrays

        return arrays.series(self.file)

    @property
    def frames(self) -> xarray.Dataset:
        """Ball states, lazy: position [m], velocity [m/s], angular_velocity [rad/s], each (time, ball, axis) in single
        precision, with mass [kg], diameter [m] and species of each ball. Only what is selected is read;
        `.chunk({"time": 10})` makes dask arrays. UserError where none are stored (`output.frames = 0 s`)."""
        from milltools.api import arrays

        return arrays.frames(self.file)

    @property
    def maps(self) -> xarray.DataTree:
        """Maps of the window, lazy: nodes cross_section (y, z) and axial (x, r), each with impact_count,
        normal_speed_sum [m/s], dissipation [J], solid_fraction and mean velocities [m/s]; edges of the cells beside them."""
        from milltools.api import arrays

        return arrays.maps(self.file)

    # ---- figures

    def plot_spectrum(self, ax: Axes | None = None, **options) -> Axes:
        """Draws the impact spectra into axes, new ones by default, and returns them. Options: group, speed, abscissa
        ("speed" or "energy"), weight ("count", "energy" or "cumulative"), kinds; for several runs in the same axes name, and
        position, its number from 0, which sets the colour (milltools.figures.spectra.plot)."""
        from milltools.api import plots

        return plots.spectrum(self.file, ax, options)

    def plot(self, name: str, *others: Result, **options) -> Figure:
        """A figure of `mill plot --figure` by its name, such as "section-power"; milltools.figures.FIGURES has them all. Of
        several runs where `others` are given. It is in no window of pyplot: a notebook shows it, savefig() keeps it."""
        from milltools.api import plots

        return plots.draw(name, [self.file, *(other.file for other in others)], options)
