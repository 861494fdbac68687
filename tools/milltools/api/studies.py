"""Studies for scripts and notebooks: `mill sweep`, `mill optimize` and their tables."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import html
import os
import pathlib
import tempfile
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from milltools.api import decks
from milltools.api.launch import Path, shown
from milltools.api.measurement import Measurement
from milltools.base.errors import InputError, MillsimError
from milltools.read import deck_text

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from milltools.study.plan.table import Table

StudyDeck = Path | decks.Sections
NAME = "a.study"  # of a study deck that is not a file


def sweep(
    study: StudyDeck, output: Path | None = None, *, retry: bool = False, force: bool = False,
    progress: bool | None = None, **options: Any,
) -> StudyResult:  # fmt: skip
    """Runs every design of a study deck and returns the study. Runs of an earlier call are not repeated.

    Failed runs give a warning. An interrupt raises KeyboardInterrupt; the same call then continues the study.

    Args:
        study: path of a study deck (docs/studies.md), the text of one, or a dictionary {"study": {...}, "vary": {...}};
            file names in a text or dictionary are relative to the current folder
        output: the table, NAME.parquet; by default the name of the study deck, in the current folder
        retry: repeat failed runs
        force: start again, also over the table of another study
        progress: show the progress; by default in a terminal or notebook
        options: names with "__" or "." are values of the study deck, study__replicates=3, vary__rotor__speed="600, 800
            rpm", or of all runs, run__time="0.2 s". The others are options of `mill sweep` for the place of the runs:
            workers=2, dask="HOST:PORT", slurm=True, ...
    """
    from milltools.study.sweep import sweep as fill

    return _filled(fill, study, output, progress, options, retry=retry, force=force)


def optimize(
    study: StudyDeck, output: Path | None = None, *, runs: int = 40, seed: int | None = None,
    storage: str | None = None, force: bool = False, progress: bool | None = None, **options: Any,
) -> StudyResult:  # fmt: skip
    """Searches the ranges of a study deck for the best design, as `mill optimize` does, and returns the study.

    Args:
        study: as for sweep()
        output: the table; by default NAME-optimize.parquet in the current folder
        runs: total number of runs, including earlier runs
        seed: of the search itself; by default the seed of the study
        storage: an Optuna storage in which several machines share a search (docs/optimize.md)
        force, progress, options: as for sweep()
    """
    from milltools.study.optimize import optimize as fill

    return _filled(fill, study, output, progress, options, runs=runs, seed=seed, storage=storage, force=force)


def load_study(path: Path) -> StudyResult:
    """Opens the table of a study, finished or growing: by its own name, its journal's or the study deck's.
    MissingFileError if it does not exist."""
    from milltools.study.show import data

    return StudyResult(data.opened(os.fspath(path))[0])


def _filled(
    fill: Any, study: StudyDeck, output: Path | None, progress: bool | None, options: Any, **more: Any
) -> StudyResult:
    """The result of sweep.sweep or optimize.optimize."""
    sets = {name: value for name, value in options.items() if "__" in name or "." in name}
    more |= {name: value for name, value in options.items() if name not in sets}
    overrides = [decks.override(name, value) for name, value in sets.items()]
    with _file(study, output) as (path, placed):
        found = fill(path, output, overrides=[*placed, *overrides], quiet=not shown(progress), **more)
    result = StudyResult(found)
    failed = result.table["message"][result.table["status"] == "failed"]
    if len(failed):
        many = f"{len(failed)} of {len(result.table)} runs failed"
        warnings.warn(f"{result.path}: {many}; the most frequent message: {failed.mode()[0]}", stacklevel=3)
    return result


@contextlib.contextmanager
def _file(study: StudyDeck, output: object) -> Iterator[tuple[str, list[str]]]:
    """(the study deck as a file, overrides with the path of its base deck)."""
    text = decks.text_of(study)
    if text is None:
        yield os.fspath(study), []  # type: ignore[arg-type]
        return
    if output is None:
        raise InputError("output: a study that is not a file needs the name of its table, such as 'speeds.parquet'")
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        file = pathlib.Path(folder) / NAME
        file.write_text(text, encoding="utf-8")
        try:
            deck = deck_text.sections(text, "deck").get("study", {}).get("deck")
            yield str(file), [f"study.deck={os.path.abspath(deck)}"] if deck else []
        except MillsimError as fault:
            lines = [line.replace(f"{file}:", f"{NAME}:") for line in fault.lines]
            raise MillsimError(lines, fault.status) from None


@dataclasses.dataclass(frozen=True)
class BestDesign:
    """`design`: the varied keys, and those that follow, as milltools.run(deck, **design) takes them; `value` of
    `objective` there, with its error."""

    design: dict[str, str]
    objective: str
    value: Measurement


class StudyResult:
    """A study: `milltools.sweep(...)`, `optimize(...)` and `load_study(path)` give it. If the study is still running,
    it contains the runs that existed when it was opened."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self.path = table.path

    @functools.cached_property
    def _view(self) -> Any:
        from milltools.study.show.data import StudyView

        return StudyView.of(self._table)

    @property
    def table(self) -> pandas.DataFrame:
        """One row per run, SI: `design`, `replicate`, `seed`, the varied keys, the objectives and recorded values, each
        with its standard error in "NAME:error", `status` (done, capped, failed), `message`, times and cost
        (docs/studies.md)."""
        return self._table.frame()

    @property
    def complete(self) -> bool:
        """Are all planned runs finished?"""
        return bool(self._table.complete)

    @property
    def best(self) -> BestDesign | None:
        """The best design of those that were run, by the first objective; None if no run has a value. With enough runs
        the value and its error are those of a Gaussian process through all of them."""
        from milltools.study.show import optimum, page

        view, objective = self._view, self._view.objectives[0]
        found = optimum.find(view, objective)
        if found is None:
            return None
        design = {key: text for key, _, text in (one.partition("=") for one in page.settings(view, found.design))}
        unit = self._table.meta["objectives"][0].get("unit", "")
        return BestDesign(design, objective.path, Measurement(found.value, found.half / optimum.REACH, unit))

    @functools.cached_property
    def _sensitivities(self) -> Any:
        from milltools.study.show import optimum

        return optimum.indices(self._table, self._view, self._view.objectives[0])

    def _figures(self, **options: Any) -> dict[str, Any]:
        from milltools.study.show import outputs

        view = self._view
        found = outputs.figures(view, view.objectives[0], self._sensitivities, **options)
        return {kind: (title, make) for kind, title, _, make in found}

    @property
    def figures(self) -> dict[str, str]:
        """The figures that `plot` can draw for this study: {name: title}."""
        return {kind: title for kind, (title, _) in self._figures().items()}

    def plot(self, name: str | None = None, **options: Any) -> Figure:
        """A picture of `mill study` by its name, the first of `figures` by default. Options of "contour": x and y,
        varied keys, and average=True for the mean over the other keys instead of a cut through the best. It has no
        window of pyplot."""
        from milltools.api import plots

        plots.shown_inline()
        found = self._figures(**options)
        name = name or next(iter(found))
        if name not in found:
            raise InputError(f"unknown figure '{name}': one of {', '.join(found)}")
        return found[name][1]()

    def __repr__(self) -> str:
        from milltools.study.show import summary

        return "\n".join(summary.lines(self._view, self._sensitivities))

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(repr(self))}</pre>"
