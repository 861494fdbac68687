"""Check before the first run: does millsim accept a design, and do the objectives exist? To find out, millsim runs one
design for a nanosecond."""

import dataclasses
import difflib
import pathlib
import tempfile

import h5py

from milltools.base.errors import UserError
from milltools.read.deck import Deck
from milltools.study.plan import job as jobs

TRIED = 5  # designs, spread over the plan, that are tried
MOMENT = ["run.sample_from=0 s", "run.time=1 ns"]


def probe(study, designs):
    """Fills in units and descriptions of the objectives. UserError if millsim refuses all of a few designs, or an
    objective is not a scalar of /statistics. Nothing is written."""
    places = sorted({round(k * (len(designs) - 1) / (TRIED - 1)) for k in range(TRIED)})
    faults = []
    for number in places:
        job = study.job(number, designs[number])
        try:
            _check(job)
            return _look(study, job)
        except UserError as fault:
            faults.append(fault)
    others = f" ({len(places) - 1} other designs were refused too)" if len(designs) > 1 else ""
    raise UserError([*faults[0].lines[:-1], f"{faults[0].lines[-1]}{others}"], faults[0].status)


def _check(job):
    """The deck as the run will have it, with the messages of the base deck."""
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        path = pathlib.Path(folder) / pathlib.Path(job["deck"]).name
        path.write_text(job["text"], encoding="utf-8")
        try:
            Deck.check(path, job["set"])
        except UserError as fault:
            raise UserError([line.replace(f"{folder}/", "") for line in fault.lines], fault.status) from None


def _look(study, job):
    job = {**job, "set": [*job["set"], *MOMENT], "objectives": [], "record": [], "limit": None}
    found = {}

    def note(name, item):
        if isinstance(item, h5py.Dataset) and item.shape == () and item.dtype.kind in "fiu":
            found[name] = (item.attrs.get("unit", ""), item.attrs.get("description", ""))

    def read(_, path):
        with h5py.File(path) as file:
            file["statistics"].visititems(note)
        return {"status": "done"}

    row = jobs.run(job, read)
    if row["status"] != "done":
        raise UserError(row["message"])
    for key, path in [*((o.goal, o.path) for o in study.objectives), *(("record", path) for path in study.record)]:
        if path not in found:
            near = difflib.get_close_matches(path, found, 1, 0.6)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            raise study.fault(key, f"'{path}' is not a scalar of /statistics in a run of this deck{hint}")
    study.objectives = [
        dataclasses.replace(o, unit=found[o.path][0], description=found[o.path][1]) for o in study.objectives
    ]
