"""The life of a liner: a chain of runs, each with the contour that the wear of the one before has left. A study deck
with a section [life], for `mill sweep` (docs/tumbling.md#the-life-of-a-liner). It fills a folder: step-K.txt, the
contour at the beginning of step K, and life.csv, a row for each run."""

import contextlib
import csv
import hashlib
import json
import math
import pathlib
import re

import numpy as np

from milltools.base import engine, processes
from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import opened, write_csv, write_text
from milltools.base.progress import Progress
from milltools.base.text import columns, duration, number, plain, plural, spoken_unit
from milltools.dose import wear
from milltools.dose.liner import Liner, equal_parts
from milltools.figures import style
from milltools.geometry.contour import Contour
from milltools.read import expression, values
from milltools.read.runfile import Run
from milltools.study.plan import filling, job, probe
from milltools.study.plan.study_deck import Lines, folded, placed_files
from milltools.study.show import canvas
from milltools.study.show.data import TURNING, Scale

NAME = "mill sweep"
KEYS = ("steps", "removed", "after", "until")
LINING = re.compile(r"drum\.(profile|file|lifter\w*|buckle\w*|repeats|wave_\d|lean_\d|tool_radius)")
LEAST = 0.1  # of the first height: less is worn out
UNIT = re.compile(r"(.*?)(?: \[([^\]]*)\])?")  # behind the name of a column
RECORD = ("power", "above_toe")
BEGIN, STEP = ("time [s]", "lost [m]"), ("step time [s]", "step lost [m]")
FIXED = ("life", "step", *BEGIN, *STEP, "height [m]", "worn [m2]", "front [rad]", "balls [kg]")


class Life:
    """A study deck with [life]; overrides as Study has them. `steps`: runs after the first one; `removed`: share of the
    first height that the tops lose in a step, or `after`: its time [s], and the other one None; `until`: it ends with
    a run whose liner stands lower than this share of the first height; `record`: expressions of results, and their
    `units` once a run has told them; `folder`: what is written to."""

    def __init__(self, path, overrides=(), folder=None):
        told = Lines(pathlib.Path(path), overrides)
        self.file, found = str(told.path), {entry.key: entry for entry in told.of("life")}
        for entry in found.values():
            if entry.key not in KEYS:
                raise entry.fault(f"unknown key; there are {', '.join(KEYS)}")
        for entry in told.of("vary"):
            raise entry.fault("nothing varies in a life but the contour: leave [vary] out")
        if ("removed" in found) == ("after" in found):
            raise UserError(f"{path}: [life]: expected one of 'removed = 5 %' and 'after = 500 h'")
        self.steps = told.whole("steps", 6, 1, section="life")
        self.removed, self.after = (self._value(found.get(name)) for name in ("removed", "after"))
        self.until, self.units = self._value(found.get("until")) or LEAST, {}
        self.record = [one for name in ("record", "maximise", "minimise") for one in told.paths(name)] or list(RECORD)
        deck, self.text, base = told.deck()
        merged, fixed = folded({value.key: value for value in base}, told.fixed(), told)
        self.fixed, files = placed_files(merged, fixed, deck)
        self.deck = str(deck)
        lines = {one.line for one in told.given_in_deck if LINING.fullmatch(f"{one.section}.{one.key}")}
        rows = enumerate(self.text.split("\n"), 1)
        self.bare = "\n".join("" if line in lines else row for line, row in rows)  # without a contour
        whole = [self.text, [value.order for value in self.fixed], self.removed, self.after, self.record]
        whole += [sorted(files.items())] * bool(files)
        self.digest = hashlib.sha256(json.dumps(whole).encode()).hexdigest()[:16]
        self.folder = pathlib.Path(folder or told.path.stem)
        self.heads = [*FIXED, *(word for name in self.record for word in (name, f"{name} error"))]

    def _value(self, entry):
        """A share, or a time [s]."""
        if entry is None:
            return None
        key, such, most = ("balls.fill", "a share such as 5 %", 1.0)
        if entry.key == "after":
            key, such, most = "run.time", "a time such as 500 h", math.inf
        try:
            (one,) = values.tell([f"{key}={entry.value}"])
        except UserError:
            raise entry.fault(f"expected {such}, got '{entry.value}'") from None
        if not 0 < one.value < most:
            raise entry.fault(f"expected {such}, got '{entry.value}'")
        return one.value

    def contour(self, step: int) -> pathlib.Path:
        return self.folder / f"step-{step}.txt"

    def job(self, step: int) -> dict:
        """The run of a step, as job.run takes it."""
        orders = [value.order for value in self.fixed if not (step and LINING.fullmatch(value.key))]
        orders += [f"run.seed={step + 1}", "run.threads=0"]
        orders += ["drum.profile=file", f"drum.file={self.contour(step).resolve()}"] if step else []
        return {
            "deck": self.deck, "text": self.bare if step else self.text, "set": orders, "values": {}, "design": step,
            "replicate": 0, "seed": step + 1, "id": f"{self.digest}-{step}", "objectives": [], "record": self.record,
            "limit": None, "program": str(engine.program().resolve()),
        }  # fmt: skip

    def rows(self, force=False) -> list[dict]:
        """The rows that are there; UserError if the folder holds anything else."""
        file = self.folder / "life.csv"
        if force or not self.folder.exists() or (self.folder.is_dir() and not any(self.folder.iterdir())):
            return []
        with opened(file, "a table", "r", newline="", encoding="utf-8") as table:
            heads, *found = [*csv.reader(table)] or [[]]
        told = [UNIT.fullmatch(head).groups() for head in heads]
        alike = [name for name, _ in told] == [UNIT.fullmatch(head)[1] for head in self.heads]
        if not alike or any(row[:1] != [self.digest] or len(row) != len(heads) for row in found):
            raise UserError(f"{self.folder}: holds the life of another study; choose another name with -o, or --force")
        read = {"life": str, "step": int}
        self.units = {name: unit for name, unit in told if name in self.record}
        return [{name: read.get(name, float)(text or "nan") for name, text in zip(self.heads, row)} for row in found]

    def live(self, quiet=False, force=False) -> list[dict]:
        """Makes the runs that the folder does not have yet; the rows of all."""
        rows = self.rows(force)
        if not rows and probe.check(self.job(0)).value("drum.profile", "circle") == "circle":
            raise UserError(
                f"{self.file}: [study] deck: expected a drum with a contour, whose wear can be drawn: give the deck "
                "drum.profile = lifters, harmonics, wavy or file"
            )
        self.folder.mkdir(exist_ok=True)
        try:
            with processes.stops_in_order(), Progress(NAME, self.steps + 1, quiet, kept=len(rows)) as progress:
                progress.due = progress.begin  # a run takes minutes
                while len(rows) <= self.steps and not self.ended(rows):
                    with progress.step(f"step {len(rows)} of {self.steps}"):
                        row = job.run(self.job(len(rows)), lambda asked, file: self.read(asked, file, rows))
                    if row["status"] == "failed":
                        raise UserError(f"{self.file}: step {len(rows)}: {row['message']}", status=1)
                    rows.append({name: row[name] for name in self.heads})
                    write_csv(self.folder / "life.csv", self._titles(), [list(one.values()) for one in rows])
        except (KeyboardInterrupt, processes.Stopped) as stop:
            text = f"interrupted; {self.folder} has {len(rows)} of {self.steps + 1} runs; the same command continues"
            raise filling.Interrupted(text, 128 + getattr(stop, "number", 2)) from None
        finally:
            with contextlib.suppress(OSError):
                self.folder.rmdir()  # if it is empty
        return rows

    def ended(self, rows) -> bool:
        return bool(rows) and rows[-1]["height [m]"] < self.until * rows[0]["height [m]"]

    def _titles(self):
        """The heads of the table with the units of what is recorded."""
        units = [f" [{self.units.get(name) or 1}]" for name in self.record for _ in (0, 1)]
        return [*FIXED, *map("".join, zip(self.heads[len(FIXED) :], units))]

    def scale(self, name) -> Scale:
        """How a recorded expression is shown."""
        unit = self.units.get(name) or ""
        return Scale(*reversed(TURNING[unit])) if unit in TURNING else Scale(unit=spoken_unit(unit))

    def read(self, asked, file, rows) -> dict:
        """The row of a run; writes the contour of the next step."""
        row, step = job.read(asked, file), asked["design"]
        if row["status"] == "failed":
            return row
        row |= {f"{name} error": row[f"{name}:error"] for name in self.record}
        with Run(file) as run:
            found, results = Liner(run), job.results_of(run)
            self.units = {name: expression.parsed(name).of(results).unit for name in self.record}
            if not step:
                write_text(self.contour(0), found.contour.text([f"life {self.digest}, step 0"]))
            rate = wear.depth_rate(found)
            known = bool(np.isfinite(rate).all() and rate.any())
            if self.after is None:
                lost = self.removed * (rows[0]["height [m]"] if rows else found.height)
                depth = found.scaled(rate if known else found.density("slid"), lost)
            elif known:
                depth = rate * self.after
            else:
                raise UserError(
                    f"{self.file}: [life] after: {self.deck} has no depths: give [wear] archard and hardness"
                )
            time = float(depth.sum() / rate.sum()) if known else math.nan
            write_text(self.contour(step + 1), found.worn(depth).text([f"life {self.digest}, step {step + 1}"]))
            begin = (rows[-1][was] + rows[-1][more] if rows else 0.0 for was, more in zip(BEGIN, STEP))
            worn = found.contour.area - Contour.read(self.contour(0)).area
            fixed = (self.digest, step, *begin, time, found.lost(depth), found.height, worn)
            fixed += (found.front, sum(one.count * one.mass for one in run.as_deck.species))
        return row | dict(zip(FIXED, fixed))


def is_life(path) -> bool:
    """Whether a study deck has [life]; False for one that cannot be read."""
    try:
        return bool(Lines(pathlib.Path(path), ()).of("life"))
    except UserError:
        return False


def over(rows) -> tuple[np.ndarray, str]:
    """What the rows are drawn over: hours if they are known, else what the tops have lost [% of the first height]."""
    hours = np.array([row["time [s]"] for row in rows]) / 3600
    if np.isfinite(hours).all() and hours.any():
        return hours, "time [h]"
    lost = np.array([row["lost [m]"] for row in rows])
    return 100 * lost / (rows[0]["height [m]"] or 1), "lost by the tops [% of the height]"


def finding(life: Life, rows) -> str:
    """What the first recorded quantity is with the new liner, and at the end."""
    name, (x, words) = life.record[0], over(rows)
    new, old = (life.scale(name).pair(row[name], row[f"{name} error"]) for row in (rows[0], rows[-1]))
    timed = words.startswith("time")
    when = f"after {x[-1]:.3g} h" if timed else f"when the tops have lost {x[-1]:.3g} % of the height"
    return f"{name} {new} with the new liner, {old} {when}"


def draw(life: Life, rows):
    """The contour around one lifter at the beginning of each step, and what was recorded over the life."""
    figure = canvas.new(5.6, 2.4 + 1.7 * len(life.record))
    shape, *axes = figure.subplots(1 + len(life.record), 1)
    x, words = over(rows)
    contours = [Contour.read(life.contour(step)) for step in range(len(rows))]
    s = np.linspace(0, 1, 8000)
    spots = [np.array(one.points(*one.at(s * one.length))) @ [1, 1j] for one in contours]
    outermost, about = abs(spots[0]).max(), np.angle(spots[0][abs(spots[0]).argmin()])
    reach = min(math.pi / equal_parts(contours[0]), 4 * rows[0]["height [m]"] / outermost)
    for step, spot in enumerate(spots):
        angle = np.angle(spot * np.exp(-1j * about))
        begin = -int(angle.argmin())
        angle, height = np.roll(angle, begin), np.roll(outermost - abs(spot), begin)
        near = abs(angle) < reach
        colour = style.SPEEDS(0.9 * step / max(len(rows) - 1, 1))
        shape.plot(1e3 * outermost * angle[near], 1e3 * height[near], color=colour)
        for ax, name in zip(axes, life.record):
            error, size = [np.nan_to_num(rows[step][f"{name} error"])], life.scale(name).size
            ax.errorbar(x[step], rows[step][name] / size, np.divide(error, size), fmt="o", color=colour, zorder=2)
    for ax, name in zip(axes, life.record):
        ax.plot(x, [row[name] / life.scale(name).size for row in rows], color=style.INK, lw=0.8, zorder=1)
        ax.set(xlabel=words if ax is axes[-1] else "", ylabel=canvas.broken(name + life.scale(name).bracket, 24))
    shape.set(xlabel="around the axis [mm]", ylabel="height [mm]")
    canvas.title(figure, f"{life.folder.name}: {finding(life, rows)}; from dark to light, with standard errors")
    style.lay_out(figure)
    return figure


def table(life: Life, rows) -> list[str]:
    """Lines for people: one for each run."""
    known, record = over(rows)[1].startswith("time"), life.record
    heads = ["step", *["time"] * known, "lost", "height", "front", "worn", "balls", *record]
    lines = [heads, ["", *["h"] * known, "mm", "mm", "deg", "cm²", "kg", *(life.scale(name).unit for name in record)]]
    for row in rows:
        told = [
            1e3 * row["lost [m]"],
            1e3 * row["height [m]"],
            math.degrees(row["front [rad]"]),
            1e4 * row["worn [m2]"],
            row["balls [kg]"],
        ]
        told = [row["step"], *[row["time [s]"] / 3600] * known, *told]
        values = (life.scale(name).told(row[name], row[f"{name} error"]) for name in record)
        lines.append([*(number(float(value)) for value in told), *(" +- ".join(filter(None, one)) for one in values)])
    return columns(lines)


def run(arguments) -> Answer:
    """`mill sweep` of a study deck with [life]."""
    life = Life(arguments.study, arguments.set, arguments.output)
    if arguments.dry_run:
        there = len(life.rows(arguments.force))
        said = f"plan       {plural(life.steps + 1, 'run')}, one after the other; {there} of them are in {life.folder}"
        cost = probe.trial(life.job(0))
        if isinstance(cost, str):
            raise UserError(f"{life.file}: {cost}")
        of_all = duration(cost[0] * (life.steps + 1 - there))
        said += f"\ncost       {'at least' if cost[2] else 'about'} {of_all} of CPU, from a trial of the first run"
        return Answer(said, {"runs": life.steps + 1, "there": there, "cpu_time": cost[0]})
    rows = life.live(arguments.quiet, arguments.force)
    files = [life.folder / "life.csv"]
    if not arguments.no_picture:
        files.append(life.folder / "life.png")
        style.save(draw(life, rows), files[-1], 150)
    first, lost, stands = (1e3 * rows[k][name] for k, name in ((0, "height [m]"), (-1, "lost [m]"), (-1, "height [m]")))
    told = f"{plural(len(rows), 'run')}" + "; the liner is worn out" * (stands < LEAST * first)
    if lost > 0:
        told += (
            f"; of {number(first)} mm the tops have lost {number(lost)} mm, and the liner stands {number(stands)} mm"
        )
        told += " high, for its plate wears, too" * (stands > first - lost)
    said = [*table(life, rows), "", "+- is one standard error"]
    if bare := [str(row["step"]) for row in rows if any(math.isnan(row[f"{name} error"]) for name in life.record)]:
        said[-1] += f"; not known in step{'s' * (len(bare) > 1)} {', '.join(bare)}: a window that had not settled,"
        said[-1] += " or fewer than four starts (run.time, run.sample_from, run.starts)"
    said.append(finding(life, rows))
    said.append(f"{plain(life.folder)}: {told}; life.csv and the contours, step-K.txt")
    return Answer("\n".join(said), {"files": files, "rows": rows})
