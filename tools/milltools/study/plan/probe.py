"""Check before the first run: does millsim accept a design, and do the objectives exist? To find out, millsim runs one
design for a nanosecond. `forecast` estimates the cost of a study from millsim's forecasts of a few designs."""

import concurrent.futures
import contextlib
import dataclasses
import pathlib
import re
import subprocess
import tempfile

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.processes import cores
from milltools.base.progress import Progress, say
from milltools.base.text import duration, plural, size
from milltools.read import expression
from milltools.read.deck import Deck
from milltools.read.runfile import Run
from milltools.read.values import tell
from milltools.study.plan import job as jobs
from milltools.study.plan.cautions import cautions

TRIED = 5  # designs, spread over the plan, that are tried
TRIALS = 1024  # places of the ranges, for those that meet the requirements on keys
MOMENT = ["run.sample_from=0 s", "run.time=1 ns"]


def probe(command, study, designs):
    """Fills in units and descriptions of the objectives. UserError if millsim refuses all of a few designs, or an
    objective, a recorded number or a requirement cannot be computed; else prints cautions. Nothing is written."""
    places = sorted({round(k * (len(designs) - 1) / (TRIED - 1)) for k in range(TRIED)})
    faults = []
    for number in places:
        job = study.job(number, designs[number])
        try:
            check(job)
            _look(study, job)
        except UserError as fault:
            faults.append(fault)
            continue
        for caution in cautions(study):
            say(command, f"warning: {caution}")
        if study.left_out:
            broken = " and ".join(study.formulas.rules)
            say(command, f"{plural(study.left_out, 'design')} that would break {broken} will not be run")
        return
    others = f" ({len(places) - 1} other designs were refused too)" if len(designs) > 1 else ""
    raise UserError([*faults[0].lines[:-1], f"{faults[0].lines[-1]}{others}"], faults[0].status)


@contextlib.contextmanager
def _deck(job):
    """The deck of a job as a file; messages do not show its folder."""
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        path = pathlib.Path(folder) / pathlib.Path(job["deck"]).name
        path.write_text(job["text"], encoding="utf-8")
        try:
            yield path
        except UserError as fault:
            raise UserError([line.replace(f"{folder}/", "") for line in fault.lines], fault.status) from None


def check(job) -> Deck:
    """The deck as the run will have it, with the messages of the base deck."""
    with _deck(job) as path:
        return Deck.check(path, job["set"])


def _look(study, job):
    job = {**job, "set": [*job["set"], *MOMENT], "objectives": [], "record": [], "limit": None}
    found = []

    def read(_, path):
        with Run(path) as run:
            found.append(jobs.results_of(run))
        return {"status": "done"}

    row = jobs.run(job, read)
    if row["status"] != "done":
        raise UserError(row["message"])
    units = {}
    for key, text in [*((o.goal, o.path) for o in study.objectives), *(("record", text) for text in study.record)]:
        try:
            units[text] = expression.parsed(text).of(found[0]).unit
        except UserError as fault:
            raise study.fault(key, str(fault), text) from None
    for one in study.require:
        try:
            one.check(found[0])
        except UserError as fault:
            raise study.fault("require", str(fault), one.expression.text) from None
    study.objectives = [
        dataclasses.replace(o, unit=units[o.path], description=expression.parsed(o.path).words)
        for o in study.objectives
    ]


# ---- the cost of a study

SAID = re.compile(
    r"forecast: (at least |at most |about )?(\S+) contacts(?: in \d+ starts)?, "
    r"(\S+) s of processor time, (\S+) MB of memory"
)
TABLE = 15e3  # [byte] of a row, with its spectra


def corners(study) -> list[dict]:
    """Designs at the corners of the ranges (at most four of them) and in their middle; of those that do not meet the
    requirements on keys, others that do."""
    ranges = [r.ordered() for r in study.vary]
    ends = [(r.low, r.high) if r.numeric else (r.values[0], r.values[-1]) for r in ranges]
    sides = [
        [0] * len(ends),
        [1] * len(ends),
        [k % 2 for k in range(len(ends))],
        [(k + 1) % 2 for k in range(len(ends))],
    ]
    found = [tuple(pair[k] for pair, k in zip(ends, side)) for side in sides] + [tuple(r.at(0.5) for r in ranges)]
    found = [dict(zip((r.key for r in study.vary), values)) for values in dict.fromkeys(found)]
    if study.formulas.rules:
        from scipy.stats import qmc

        more = qmc.Sobol(len(ranges), seed=study.seed).random(TRIALS)
        found += [{r.key: r.at(float(share)) for r, share in zip(ranges, row)} for row in more]
        found = [design for design in found if study.formulas.met(design)][:TRIED]
        if not found:
            raise study.fault("require", f"no design was found that meets {' and '.join(study.formulas.rules)}",
                              study.formulas.rules[0])  # fmt: skip
    return found


def trial(job) -> tuple[float, float, bool] | str:
    """CPU time [s] and memory [byte] of a run, and whether this is a lower bound; or why millsim refuses it."""
    with _deck(job) as path:
        words = [word for text in job["set"] for word in ("-s", text)]
        done = subprocess.run([job["program"], "--check", "-s", "output.frames=0 s", *words, "--", path.name],
                              capture_output=True, text=True, cwd=path.parent)  # fmt: skip
    found = SAID.search(done.stderr)
    if done.returncode or not found:
        return (done.stderr.strip().splitlines() or ["no forecast"])[-1].removeprefix("millsim: ")
    cpu = float(found[3]) if job["limit"] is None else min(float(found[3]), job["limit"])
    return cpu, 1e6 * float(found[4]), found[1] == "at least "


def answer(command, study, plan: str, missing: int, where, quiet=False) -> Answer:
    """What --dry-run says: the line `plan`, and the cost of the `missing` runs at `where`."""
    lines = [plan]
    if missing > 0:
        lines += forecast(command, study, missing, where.at_once, quiet)
    return Answer("\n".join(lines), {"files": [], "missing_runs": missing, "forecast": lines})


def forecast(command, study, runs: int, workers: int, quiet=False) -> list[str]:
    """The cost of `runs` runs, `workers` at once, as text. Only trials are run, and nothing is written."""
    designs = corners(study)
    with Progress(command, len(designs), quiet) as progress, concurrent.futures.ThreadPoolExecutor(cores()) as pool:
        found = []
        for told in pool.map(lambda one: trial(study.job(0, one)), designs):
            found.append(told)
            progress(len(found), f"forecast of {len(found)} of {len(designs)} designs")
    sizes = {one.key: one.value for one in tell(f"{r.key}=1 {r.written}" for r in study.vary if r.written)}
    lines = []
    for design, told in zip(designs, found):
        words = []
        for r in study.vary:
            value = f"{design[r.key] / sizes.get(r.key, 1):.5g}" if r.numeric else design[r.key]
            words.append(f"{r.key} = {value} {r.written or ('' if r.unit == '1' else r.unit)}".rstrip())
        cost = told
        if not isinstance(told, str):
            cost = f"{'at least ' * told[2]}{told[0]:.2g} s of CPU, {size(told[1])} of memory"
        lines.append(f"    {', '.join(words)}: {cost}")
    known = [told for told in found if not isinstance(told, str)]
    if not known:
        raise UserError(f"millsim refuses all of these designs: {found[0]}")
    cpu, memory, bounds = zip(*known)
    about = "at least" if any(bounds) else "about"
    mean = sum(cpu) / len(cpu)
    least, most = duration(runs * min(cpu)), duration(runs * max(cpu))
    between = f" (between {least} and {most} if all were like one of these)" if least != most else ""
    many = min(workers, runs)
    return [
        f"forecast   from a trial of {plural(len(designs), 'design')} at the ends of the ranges (millsim --check):",
        *lines,
        f"cost       {about} {duration(runs * mean)} of CPU{between}",
        f"time       {about} {duration(runs * mean / many)} with {plural(many, 'run')} at a time",
        f"memory     {size(many * max(memory))} at a time; the table: about {size(runs * TABLE)}",
        "no run was begun, and nothing was written",
    ]
