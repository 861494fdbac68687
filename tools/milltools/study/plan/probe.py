"""Check before the first run: does millsim accept a design, and do the objectives exist? To find out, millsim runs one
design for a nanosecond."""

import dataclasses
import pathlib
import tempfile

from milltools.base.errors import UserError
from milltools.read import expression
from milltools.read.deck import Deck
from milltools.read.results import Results
from milltools.read.runfile import Run
from milltools.study.plan import job as jobs

TRIED = 5  # designs, spread over the plan, that are tried
MOMENT = ["run.sample_from=0 s", "run.time=1 ns"]


def probe(study, designs):
    """Fills in units and descriptions of the objectives. UserError if millsim refuses all of a few designs, or an
    objective, a recorded number or a requirement cannot be computed. Nothing is written."""
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
    raise UserError(f"{faults[0]}{others}", faults[0].status)


def _check(job):
    """The deck as the run will have it, with the messages of the base deck."""
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        path = pathlib.Path(folder) / pathlib.Path(job["deck"]).name
        path.write_text(job["text"], encoding="utf-8")
        try:
            Deck.check(path, job["set"])
        except UserError as fault:
            raise UserError(str(fault).replace(f"{folder}/", ""), fault.status) from None


def _look(study, job):
    job = {**job, "set": [*job["set"], *MOMENT], "objectives": [], "record": [], "limit": None}
    found = []

    def read(_, path):
        with Run(path) as run:
            found.append(Results.of(run))
        return {"status": "done"}

    row = jobs.run(job, read)
    if row["status"] != "done":
        raise UserError(row["message"])
    units = {}
    for key, text in [*((o.goal, o.path) for o in study.objectives), *(("record", text) for text in study.record)]:
        try:
            units[text] = expression.parsed(text).of(found[0]).unit
        except UserError as fault:
            raise study.fault(key, str(fault)) from None
    for one in study.require:
        try:
            one.check(found[0])
        except UserError as fault:
            raise study.fault("require", str(fault)) from None
    study.objectives = [
        dataclasses.replace(o, unit=units[o.path], description=expression.parsed(o.path).words)
        for o in study.objectives
    ]
