"""`mill check`: runs a deck with hard and with soft spheres from several starts, and says whether they agree."""

import concurrent.futures
import json
import pathlib
import shlex
import subprocess
import time

from milltools.base import engine, processes
from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import write_text
from milltools.base.progress import Progress, say
from milltools.base.text import duration, plural, quantity

NAME = "mill check"
SUMMARY = (
    "Runs a deck with hard and with soft spheres, on a stretch that takes some minutes, from several starts, and says "
    "in one sentence whether hard spheres hold for this mill. After an interruption the same command continues."
)


MOST_MINUTES = 1e5


def add_arguments(parser):
    add = parser.add_argument
    add("deck", help="deck of the mill, as for millsim")
    add("-o", "--output", metavar="FOLDER", help="folder of the runs; default: the deck's name with -check, here")
    add(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="override one value of the deck; may be repeated",
    )  # fmt: skip
    add("--minutes", type=float, help="of wall-clock time, about; default 3, and at most 24 starts")
    add("--modulus", help="of the soft spheres: '10 GPa' or 'steel'; default: the stiffest for which there is time")
    add("--starts", type=int, help="of each kind of spheres; default: 6 or more")
    add("--time", help="end of all runs, such as '0.5 s'; default: what there is time for")
    add("-f", "--force", action="store_true", help="start again, also over the runs of another check")
    add("-q", "--quiet", action="store_true", help="no progress")


def value(key, text):
    """An argument as the deck reads it [SI]."""
    return None if text is None else float(engine.ask("--value", f"{key}={text}").split("\t")[2])


def run(arguments) -> Answer:
    from milltools.check import plan as plans
    from milltools.check import verdict

    if arguments.starts is not None and arguments.starts < 2:
        raise UserError(f"--starts {arguments.starts}: expected 2 or more: their scatter gives the errors")
    if arguments.minutes is not None and not 0 < arguments.minutes <= MOST_MINUTES:
        raise UserError(f"--minutes {arguments.minutes:g}: expected more than 0, and at most {MOST_MINUTES:g}")
    modulus, end = value("soft.modulus", arguments.modulus), value("run.time", arguments.time)
    deck = plans.read(arguments.deck, arguments.set)
    folder = pathlib.Path(arguments.output or f"{pathlib.Path(arguments.deck).stem}-check")
    asked = {"minutes": arguments.minutes, "modulus": modulus, "starts": arguments.starts, "time": end}
    asked["deck"] = deck.text
    plan = None if arguments.force else plans.load(folder, asked)
    if not plan:
        if not arguments.quiet:
            say(NAME, f"{arguments.deck}: trying what a simulated second costs")
        plan = plans.make(deck, arguments.minutes, modulus, arguments.starts, end)
    stretch = f"{quantity(plan.time, 's')}, sampled from {quantity(plan.sample_from, 's')}"
    said = (
        f"{plural(plan.starts, 'start')} of {stretch}, with hard spheres and with soft ones of "
        f"{verdict.stuff(plan.modulus)}: about {duration(plan.wall)} on {plural(processes.cores(), 'core')}"
    )
    if not arguments.quiet:
        say(NAME, said)
    plans.save(folder, asked, plan)
    with plans.alone(folder):
        jobs = _jobs(arguments, deck, plan, folder)
        for file, _ in jobs:
            if file.is_symlink():
                raise UserError(f"{file}: is a link: expected a file of this check, or none")
        _run_all(jobs, plan, arguments)
        return _judge(arguments, plan, folder, jobs)


def _jobs(arguments, deck, plan, folder):
    """(file, words of the command) of each run: first the soft ones, which take longer."""
    from milltools.check import plan as plans

    starts = plans.start_files(deck, folder, plan.starts)
    sets = [*arguments.set, *plan.sets(deck)]
    jobs = []
    for kind in ("soft", "hard"):
        own = [f"run.spheres={kind}", "run.starts=1", f"output.strike_window={plan.contact:.9g} s"]
        own += [f"soft.modulus={plan.modulus:.9g} Pa"] * (kind == "soft")
        for k in range(plan.starts):
            file = folder / f"{kind}-{k + 1}.h5"
            seed = deck.count("run.seed") + k
            each = [*sets, *own, f"run.seed={seed}"] + ([f"balls.start={starts[k].absolute()}"] if starts[k] else [])
            words = ["--force" if arguments.force else "--resume", "-q", "-o", file]
            jobs.append((file, [*words, *(word for one in each for word in ("-s", one)), "--", arguments.deck]))
    return jobs


def _run_all(jobs, plan, arguments):
    """All runs, on all cores. An interrupted one is saved by millsim and resumed by the next check."""
    running = set()

    def one(job):
        process = subprocess.Popen(
            [*processes.guard("INT"), engine.program(), *job[1]], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            start_new_session=True,
        )  # fmt: skip
        running.add(process)
        said = process.communicate()[1].decode(errors="replace")
        running.discard(process)
        if process.returncode != 0:
            raise UserError([f"{job[0]}: {line}" for line in engine.complaints(process.returncode, said)], 1)

    pool, begin = concurrent.futures.ThreadPoolExecutor(processes.cores()), time.monotonic()
    with processes.stops_in_order(), Progress(NAME, len(jobs), arguments.quiet) as watch:
        waiting = [pool.submit(one, job) for job in jobs]
        try:
            while pending := [future for future in waiting if not future.done()]:
                done = len(jobs) - len(pending)
                watch(done, plural(done, "run"), max(plan.wall - (time.monotonic() - begin), 0.0) or None)
                concurrent.futures.wait(pending, 0.5, concurrent.futures.FIRST_EXCEPTION)
                for future in waiting:
                    if future.done():
                        future.result()
        except BaseException as fault:
            if not isinstance(fault, UserError):
                say(NAME, "stopped: the same command continues")
            pool.shutdown(wait=False, cancel_futures=True)
            for process in list(running):
                process.terminate()
            raise
        for future in waiting:
            future.result()
    pool.shutdown()


def _judge(arguments, plan, folder, jobs) -> Answer:
    from milltools.check import verdict

    soft, hard = ([str(file) for file, _ in jobs if file.name.startswith(kind)] for kind in ("soft", "hard"))
    found = verdict.findings(hard, soft)
    words, state = verdict.sentence(found, plan.modulus)
    both = " ".join(f"$(echo {shlex.quote(str(folder))}/{kind}-*.h5 | tr ' ' ,)" for kind in ("soft", "hard"))
    text = [
        *verdict.lines(found),
        "+- is one standard error, from the scatter between starts; agrees: within 3 % (powers and kinetic energy) or",
        "10 % (the rest), and known to half of that. Re-contacts within the time of a soft contact are one impact.",
        f"everything else: {engine.called()} compare {both}",
        "",
        words,
    ]
    facts = {
        "files": [file for file, _ in jobs], "deck": arguments.deck, "folder": folder, "verdict": state,
        "sentence": words, "modulus": plan.modulus,
        "time": plan.time, "sample_from": plan.sample_from, "starts": plan.starts,
        "quantities": {
            one.key: {"hard": one.hard, "soft": one.soft, "difference": one.difference, "error": one.error,
                      "unit": one.unit, "state": one.state}
            for one in found
        },
    }  # fmt: skip
    write_text(folder / "check.json", json.dumps(facts, default=str, indent=1))
    return Answer("\n".join(text), facts)
