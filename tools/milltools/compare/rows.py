"""The table: every quantity of two sides, its difference, how sure that is, and a verdict in words."""

import dataclasses
import math

import numpy as np

from milltools.compare import agreement as errors
from milltools.compare import map_deviation as maps
from milltools.compare.agreement import Estimate
from milltools.compare.load import CONDUCT, GEOMETRY, LEVELS, Member, Side, designs, different_keys, usual
from milltools.read import sums
from milltools.read.kinds import KINDS
from milltools.read.kinds import label as label_of
from milltools.read.runfile import HARD_PER_JOULE, HARD_RATE, THRESHOLDS, Hard

HARD_SOFT = "not comparable between hard and soft spheres"
STIFFNESS = "depends on the stiffness"
OTHER_FLOORS = "counted from other speeds, because the rebound floors differ"
SOFT = ("rate_all", "median", "median_above_floor")  # keys of rows that depend on the stiffness of spheres
IDENTICAL = "agree: the same data"
ZERO = "zero within the errors of both"
NOT_COMPARED = (ZERO, HARD_SOFT, STIFFNESS, OTHER_FLOORS)
HARD = 1.0  # [m/s] one of THRESHOLDS
LEAST_SHARE = 0.01  # of the dissipated power: a kind of contact with less is not among the important rows


NAMES = {
    "normal_dissipation": "lost power, normal part", "tangential_dissipation": "lost power, tangential part",
    "rate_all": "all impacts, per s",
    "dissipated_power": "lost power, all",
    "median": "median impact speed, all", "median_above_floor": "median above the floor",
}  # fmt: skip  # of the important rows


@dataclasses.dataclass(frozen=True)
class Row:
    """One line. `difference` and `difference_error` relative to A; `mood` of the verdict: agree, differ, open; of two
    designs tied, apart, open. A value of NaN: the file does not contain it."""

    group: str
    key: str
    label: str
    unit: str
    a: Estimate
    b: Estimate
    difference: float = math.nan
    difference_error: float = math.nan
    dof: float = 0
    verdict: str = ""
    mood: str = "open"
    remark: str = ""

    @property
    def name(self) -> str:
        """Its label where it stands without the rows of its group."""
        start, _, speed = self.key.rpartition("_")
        if start == "hard_per_joule":
            return f"impacts > {speed} m/s, per joule"
        if start == "rate_all_above":
            return f"impacts > {speed} m/s, per s"
        if self.key.startswith("dissipated_power_"):
            return f"lost power, {self.label.strip()}"
        return NAMES.get(self.key, self.label)

    @property
    def bare(self) -> bool:
        """Whether the sides certainly differ, but by no ratio: one of them has none."""
        return self.mood in ("apart", "differ") and not math.isfinite(self.difference_error)

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the difference, relative to A."""
        half = errors.NORMAL * self.difference_error
        return self.difference - half, self.difference + half


@dataclasses.dataclass(frozen=True)
class Comparison:
    """The comparison of side b with side a; of two `designs`, or of a mill by two programs or from other starts."""

    a: Side
    b: Side
    rows: list[Row]
    designs: bool = False
    keys: tuple[str, ...] = ()  # of the mill that differ
    threshold: Hard = Hard(1e-3)

    @property
    def title(self) -> str:
        return f"{self.b.letter} against {self.a.letter}"

    def row(self, key: str) -> Row | None:
        return next((row for row in self.rows if row.key == key), None)

    @property
    def power(self) -> Row | None:
        return self.row("drive_power") or self.row("rotor_power")

    @property
    def hard(self) -> tuple[str, Row | None, Row | None]:
        """The impacts that are called hard, in words, and their rows per second and per joule of work of the
        drive: those of the energy that A says, also where one side has none; above 1 m/s where the error of
        that is not known; above a lower speed in a slow mill. Where no error is known, the first of these with
        a row."""
        speeds = sorted(THRESHOLDS, key=lambda speed: (speed != HARD, speed))
        kinds = [(self.threshold.words, HARD_RATE, HARD_PER_JOULE)] + [
            (f"above {speed:g} m/s", f"rate_all_above_{speed:g}", f"hard_per_joule_{speed:g}") for speed in speeds
        ]
        found = [(words, self.row(rate), self.row(per)) for words, rate, per in kinds]
        known = (one for one in found if one[1] and (math.isfinite(one[1].difference_error) or one[1].bare))
        return next(known, None) or next((one for one in found if one[1]), found[0])

    @property
    def important(self) -> list[Row]:
        """The rows of the forest plot, in its order, without those that have no difference."""
        whole = self.row("dissipated_power")
        least = [LEAST_SHARE * abs(e.value) for e in (whole.a, whole.b)] if whole else (0, 0)
        keys = [
            "drive_power", "rotor_power", HARD_PER_JOULE, *(f"hard_per_joule_{speed:g}" for speed in THRESHOLDS),
            *(row.key for row in self.hard[1:2] if row), "rate_all", "median_above_floor", "median",
            "normal_dissipation", "tangential_dissipation",
        ]  # fmt: skip
        lost = [
            row.key
            for row in self.rows
            if row.key.startswith("dissipated_power_") and (row.a.value > least[0] or row.b.value > least[1])
        ]
        found = filter(None, map(self.row, [*keys, *lost]))
        return [row for row in found if math.isfinite(row.difference_error) and row.verdict not in NOT_COMPARED]

    @property
    def shown(self) -> list[Row]:
        """The rows with information: without those that are zero on both sides."""
        return [row for row in self.rows if row.verdict != ZERO]

    @property
    def zeros(self) -> str:
        """The other rows in one sentence."""
        words = ", ".join(row.label.strip() for row in self.rows if row.verdict == ZERO)
        return f"Zero within their errors in {self.a.letter} and in {self.b.letter}: {words}." if words else ""


# ---- quantities of a run, each as measure(run) -> Estimate, or None if the file does not contain it


def told(name, otherwise):
    """The value and error from the file; if the file has none, `otherwise` measures them."""
    return lambda run: errors.from_file(run.known(name)) or otherwise(run)


def added(run: Member, name: str, kind: str, column=None):
    """Rate of a cumulative series of one kind, or of "all" kinds added up, and its blocks; None if the file does not
    contain it."""
    names = [name.format(kind=k) for k in (run.kinds if kind == "all" else [kind])]
    if not all(map(run.has_series, names)):
        return None
    parts = [run.rates(n, column) for n in names]
    return sum(p[0] for p in parts), sum(p[1] for p in parts)


def power(name, kind="", divisor=lambda run: 1.0):
    """Rate of a cumulative series over the `divisor` of the run."""

    def measure(run: Member):
        found = added(run, name, kind)
        return found and errors.from_blocks(*(part / divisor(run) for part in found))

    return measure


def drive_power(run: Member):
    """Power of the rotor, or of all motions together."""
    return errors.from_file(run.known(f"{run.drive}_power")) or errors.from_blocks(*run.rates("drive_work"))


def tangential(run: Member):
    """Dissipated power without its normal part."""
    both = [added(run, f"{name}/{{kind}}", "all") for name in ("dissipation", "dissipation_normal")]
    return errors.from_blocks(*(one - two for one, two in zip(*both))) if all(both) else None


# at constant speed the work of a rotor is proportional to its torque
torque = told("rotor_torque", power("rotor_work", divisor=lambda run: run.rotor_speed or math.inf))


def mean(name):
    return lambda run: errors.from_blocks(*run.means(name)) if run.has_series(name) else None


def final(name):
    """At the end of the window; one moment has no error of its own."""
    return lambda run: Estimate(float(np.interp(run.span[1], *run.series(name)))) if run.has_series(name) else None


def fast(kind, column, strikes=False):
    """Rate of impacts (or strikes) at or above a threshold."""

    def measure(run: Member):
        if kind not in (*run.kinds, "all"):
            return None
        known = errors.from_file(run.known(f"rate_above_{THRESHOLDS[column]:g}/{kind}"))
        if known and not strikes:
            return known
        count = run.histogram(kind, "strikes" if strikes else "impacts").above(THRESHOLDS[column])
        value = count / run.duration
        remark = "relative error of the impacts" if strikes else ""
        if known and known.value > 0:
            return Estimate(value, value * (known.error / known.value), known.dof, remark)
        found = added(run, "fast_collisions/{kind}", kind, column)
        rate, blocks = found or (0, None)
        if not rate > 0:
            return Estimate(value)
        estimate = errors.from_blocks(value, blocks * value / rate, remark)
        counting = value / math.sqrt(count) if count else 0.0
        # a rate of few impacts scatters at least as much as their count (Poisson)
        return dataclasses.replace(estimate, error=max(estimate.error, counting))

    return measure


def energetic(hard):
    """Rate of `hard` impacts; None if the file has no energies."""

    def measure(run: Member):
        if run.hard == hard and not hard.found and (known := run.known(HARD_RATE)):
            return errors.from_file(known)
        if not run.has("statistics/energies/edges"):
            return None
        found = sums.total(run, sums.above(hard.energy), hard.by)
        return errors.from_file((found.value, *found.spread))

    return measure


def per_joule(measured, weight, sort="normal"):
    """Impacts of a `measured` rate, divided by the work of the drive. `weight` counts them, by this energy."""

    def measure(run: Member):
        rate, power = measured(run), drive_power(run)
        if not (rate and power.value > 0):
            return None
        value = rate.value / power.value
        if not (rate.value and sums.has_errors(run)):
            return Estimate(value)
        found, error, freedom = sums.per_work(run, sums.total(run, weight, sort))
        return errors.from_file((value, value * error / found, freedom))

    return measure


def all_impacts(run: Member):
    value = run.histogram("all").above(0.0) / run.duration
    return errors.from_blocks(value, sum(run.rates(f"collisions/{kind}")[1] for kind in run.kinds))


def median(name):
    """Median impact speed. Impacts come in bursts, so the error does not follow from their number (two seeds of the
    reference mill differed eight times as much as with independent impacts): the file gives the error, or only
    replicates do."""
    return told(name, lambda run: Estimate(float(run.statistic(f"impacts/all/normal_speed/{name}"))))


def ball_speed(column):
    """Speed of all balls, mean over the frames in the window: column 0 mean, 1 rms, 2... quantiles."""

    def measure(run: Member):
        if not len(run.speeds):
            return None
        value, blocks = float(run.speeds[:, column].mean()), run.speed_blocks_of(column)
        if column == 1:
            blocks, value = blocks**0.5, value**0.5
        # frames are of the first start, which tells nothing of the scatter between starts
        return errors.from_blocks(value, blocks) if len(run.speeds) >= 8 and run.starts == 1 else Estimate(value)

    return measure


def threshold(first: Member, second: Member):
    """Which impacts are hard on both sides: those of the side whose deck says it, else of the first."""
    return next((run.hard for run in (first, second) if not run.hard.found), first.hard)


def quantities(steady: bool, kinds, first: Member, second: Member):
    """(group, key, label, unit, measure) of every row but maps and cost, for these kinds; `first` and `second` are the
    runs whose drives are compared."""
    group, both = "power", (first, second)
    who = "drive" if any(run.drive == "drive" for run in both) else "rotor"
    yield group, f"{who}_power", f"{who} power", "W", drive_power
    shared = [name for name in first.motions if name in second.motions] if who == "drive" else []
    for name in shared if len(shared) > 1 else ():
        yield (
            group,
            f"motion_power_{name}",
            f"  of motion {name}",
            "W",
            told(f"power/{name}", power(f"motion_work/{name}")),
        )
    if all(run.rotor_speed for run in both):
        yield group, "rotor_torque", "rotor torque", "N m", torque
    for kind in ("all", *kinds):
        key = "dissipated_power" + (f"_{kind}" if kind != "all" else "")
        label = "dissipated power, all" if kind == "all" else f"  {_label(kind)}"
        yield group, key, label, "W", told(f"dissipated_power/{kind}", power("dissipation/{kind}", kind))
    yield group, "tangential_dissipation", "  tangential part, all kinds", "W", tangential
    for kind in ("all", *kinds):
        key = "normal_dissipation" + (f"_{kind}" if kind != "all" else "")
        label = f"  normal part, {_label(kind)}"
        measure = told(f"dissipated_power_normal/{kind}", power("dissipation_normal/{kind}", kind))
        yield group, key, label, "W", measure
    group = "energy"
    for name in ("kinetic", "rotational", "elastic"):
        yield group, f"{name}_energy", f"{name} energy, mean", "J", mean(f"{name}_energy")
        if not steady:
            yield group, f"{name}_energy_end", f"{name} energy, at the end", "J", final(f"{name}_energy")
    group = "impacts"
    merged = [(kind, True) for kind in kinds if kind == "ball_blade" or kind not in KINDS]
    for kind, strikes in [*((kind, False) for kind in ("all", *kinds)), *merged]:
        for column, speed in enumerate(THRESHOLDS):
            key = f"{'strike_' if strikes else ''}rate_{kind}_above_{speed:g}"
            label = f"{_label(kind)} above {speed:g} m/s{' (strikes)' if strikes else ''}"
            yield group, key, label, "1/s", fast(kind, column, strikes)
    for column, speed in enumerate(THRESHOLDS):
        measure = per_joule(fast("all", column), sums.faster(speed))
        yield group, f"hard_per_joule_{speed:g}", f"all kinds above {speed:g} m/s per joule", "1/J", measure
    if math.isfinite((hard := threshold(first, second)).energy):
        rate = energetic(hard)
        each = per_joule(rate, sums.above(hard.energy), hard.by)
        yield group, HARD_RATE, f"impacts {hard.words}, per s", "1/s", rate
        known = not hard.found and second.hard == hard
        yield (
            group,
            HARD_PER_JOULE,
            f"impacts {hard.words}, per joule",
            "1/J",
            (told(HARD_PER_JOULE, each) if known else each),
        )
    yield group, "rate_all", "impacts, all", "1/s", told("rate/all", all_impacts)
    yield group, "median", "median v_n, all impacts", "m/s", median("median")
    yield group, "median_above_floor", "median v_n above the floor", "m/s", median("median_above_floor")
    names = [("mean", "mean"), ("rms", "rms"), *((f"{100 * p:g}", f"{100 * p:g} % are slower") for p in LEVELS)]
    for column, (name, words) in enumerate(names):
        yield "balls", f"ball_speed_{name}", f"speed of balls, {words}", "m/s", ball_speed(column)


def _label(kind: str) -> str:
    return "all kinds" if kind == "all" else label_of(kind)


def _trusted(found: Estimate | None, run: Member) -> Estimate | None:
    """The estimate without an error, if errors of this run would be wrong."""
    return dataclasses.replace(found, error=math.nan, dof=0) if found and run.doubt else found


def compare(a: Side, b: Side) -> Comparison:
    """The table of side b against side a."""
    two_designs = designs(a, b)
    steady = a.steady and b.steady
    identical = len(a.runs) == len(b.runs) and all(x.same_data(y) for x, y in zip(a.runs, b.runs))
    kinds = tuple(dict.fromkeys(kind for side in (a, b) for kind in side.first.kinds))
    unknown = "error unknown: too few blocks, frames or impacts"
    if not steady:
        several = any(len(side.runs) > 1 for side in (a, b))
        unknown = "error unknown: " + ("too few replicates" if several else "not steady, no replicates")
    elif doubt := next((f"{side.letter} {run.doubt}" for side in (a, b) for run in side.runs if run.doubt), ""):
        unknown = f"error unknown: {doubt}"
    rows = []
    for *what, measure in quantities(steady, kinds, a.first, b.first):
        sides = [[_trusted(measure(run), run) for run in side.runs] for side in (a, b)]
        held = [all(e is not None for e in side) for side in sides]
        if not any(held) or all(e.value == 0 for s, h in zip(sides, held) if h for e in s):
            continue
        if not all(held):
            there, missing = ("A", b.letter) if held[0] else (b.letter, "A")
            values = (Estimate(errors.mean_of(s).value if h else math.nan) for s, h in zip(sides, held))
            verdict = f"only in {there}: the file of {missing} does not contain it"
            rows.append(Row(*what, *values, verdict=verdict))
            continue
        one, two = errors.combine(*sides, steady)
        found = errors.difference(one, two, unknown, two_designs)
        if identical and two.value == one.value:
            found = found._replace(verdict=IDENTICAL, mood="agree")
        elif what[1] == "median_above_floor" and abs(a.first.above_floor / b.first.above_floor - 1) > 1e-3:
            found = found._replace(verdict=OTHER_FLOORS, mood="open")
        elif what[1] in SOFT and (a.soft or b.soft):
            found = found._replace(verdict=STIFFNESS if a.soft and b.soft else HARD_SOFT, mood="open")
        elif is_zero(one) and is_zero(two):
            found = found._replace(verdict=ZERO, mood="open")
        rows.append(Row(*what, one, two, *found, one.remark or two.remark))
    rows += map_rows(a, b, steady, identical, two_designs)
    rows.append(price_row(a, b))
    keys = (key for key in different_keys(a.first.deck(), b.first.deck()) if not CONDUCT.fullmatch(key))
    return Comparison(a, b, rows, two_designs, tuple(keys), threshold(a.first, b.first))


def is_zero(found: Estimate) -> bool:
    return found.value == 0 or abs(found.value) <= errors.NORMAL * found.told


def tables(sides: list[Side]) -> list[Comparison]:
    return [compare(sides[0], side) for side in sides[1:]]


def map_rows(a: Side, b: Side, steady: bool, identical: bool, two_designs: bool):
    """Deviations of maps: the weighted rms instead of the difference, what noise explains instead of its error."""
    for view, where in (("cross_section", "cross-section"), ("axial", "axial map")):
        for name, what in (("solid_fraction", "solid fraction"), ("velocity", "velocity")):
            found = maps.deviation(a, b, view, name, steady)
            label, nothing = f"{what}, {where}, rms", Estimate(math.nan)
            row = ("maps", f"map_{view}_{name}", label, "", nothing, nothing)
            if found is None:
                yield Row(*row, verdict="no cell is filled in both")
            else:
                words, mood = (IDENTICAL, "agree") if identical and found[0] == 0 else maps.verdict(*found)
                mood = {"agree": "tied", "differ": "apart"}.get(mood, mood) if two_designs else mood
                yield Row(*row, *found, 0, words, mood, "error: the deviation that noise explains")


def price_row(a: Side, b: Side) -> Row:
    one, two = (errors.mean_of([Estimate(r.cost) for r in side.runs]) for side in (a, b))
    ratio = two.value / one.value
    dear, cheap = (b.letter, "A") if ratio >= 1 else ("A", b.letter)
    if not math.isfinite(ratio) or ratio <= 0:
        verdict = "unknown"
    elif 0.99 < ratio < 1.01:
        verdict = "the same cost"
    else:
        verdict = f"{dear} costs {max(ratio, 1 / ratio):.3g} times as much as {cheap}"
    return Row("price", "cost", "CPU seconds per simulated s", "s/s", one, two, ratio - 1, verdict=verdict)


# ---- notes for the reader


def deck_differences(sides: list[Side]) -> list[tuple[str, list[str]]]:
    """(key, value on every side) of all keys that are not the same everywhere, in rpm and degrees; "" where a deck
    does not have it."""
    decks = [side.first.deck() for side in sides]
    keys = dict.fromkeys(key for other in decks[1:] for key in different_keys(decks[0], other))
    if any(side.first.program != "millsim" for side in sides):  # its spheres are not what the deck says
        keys = [key for key in keys if key != "run.spheres" and not key.startswith("soft.")]
    return [(key, [usual(deck.get(key, "")) for deck in decks]) for key in keys]


def strike_notes(a: Side, b: Side) -> list[str]:
    """Notes if the sides merge re-contacts differently. A soft contact merges the re-contacts within its duration."""
    hard, soft = (b, a) if a.soft else (a, b)
    window = hard.first.strike_window
    lasts = soft.first.contact_duration
    if not hard.soft and not 0.67 * lasts < window < 1.5 * lasts and math.isfinite(lasts):
        return [
            f"Contacts last {1e6 * lasts:.3g} us in {soft.letter}, {hard.letter} counts impacts within "
            f"{1e6 * window:.3g} us as one strike: to compare strikes, set output.strike_window = {1e6 * lasts:.3g} us "
            "in both decks."
        ]
    if abs(a.first.strike_window - b.first.strike_window) > 1e-6 * a.first.strike_window:
        return [
            f"A counts impacts within {1e6 * a.first.strike_window:.3g} us as one strike, {b.letter} within "
            f"{1e6 * b.first.strike_window:.3g} us: to compare strikes, set output.strike_window in both decks."
        ]
    return []


def notes(sides: list[Side], tables: list[Comparison]) -> list[str]:
    """Warnings and how the errors were made, one sentence each."""
    return warnings(sides) + methods(sides, tables)


def warnings(sides: list[Side]) -> list[str]:
    said = []
    a, (begin, end) = sides[0], sides[0].first.window
    for side in sides:
        for run in side.runs:
            who = f"{side.letter} ({run.path})"
            if run.status != "complete":
                said.append(f"{who} is not complete (status '{run.status}'): it ends at {run.time:.4g} s.")
            said += [f"{who}: {note.rstrip('.')}." for note in run.notes]
            if not run.steady:
                said.append(f"{who} is not steady over its window: {run.trend}.")
    for side in sides[1:]:
        apart = np.abs(np.subtract(side.first.window, (begin, end)))
        if apart[0] > 1e-9 or apart[1] > 1e-6 * (end - begin):
            said.append(f"The sampled windows of A and {side.letter} differ.")
        keys = different_keys(a.first.deck(), side.first.deck())
        shape = [key for key in keys if GEOMETRY.fullmatch(key)]
        if shape and not designs(a, side):
            said.append(f"The geometry of A and {side.letter} differs: {', '.join(shape)}.")
        said += strike_notes(a, side)
        if a.soft != side.soft:
            said.append(
                f"{(a if a.soft else side).letter} has soft spheres, whose impacts are counted differently: rates and "
                "medians of all impacts are not comparable; fast impacts, losses, energies and maps are comparable."
            )
    return said


def methods(sides: list[Side], tables: list[Comparison]) -> list[str]:
    said = []
    if all(len(sides[0].runs) + len(side.runs) >= 5 for side in sides[1:]):
        said.append("Errors come from the scatter between the runs of a side.")
    elif all(side.steady for side in sides):
        cuts = dict.fromkeys(f"{s.letter} {r.cut}" for s in sides for r in s.runs[:1])
        said.append(
            "Errors of powers, medians and rates come from the files. All other errors, and those of files "
            f"without errors, come from the scatter between starts or blocks of time: {'; '.join(cuts)}. With "
            f"{errors.FEWEST_FOR_CORRELATION} or more blocks, correlation between neighbours makes the errors larger; "
            "fewer blocks count as independent."
        )
    else:
        said.append(
            "Blocks of a run that is not steady are not samples of one mean: errors come from the scatter between "
            "replicates (a1.h5,a2.h5). Without replicates the errors are unknown."
        )
    if any(table.designs for table in tables):
        said.append(
            "Higher or lower: the 95 % interval of the difference does not contain zero. Tied: it contains zero. "
            f"Undecided: it contains zero and is wider than +-{100 * errors.COARSE:g} %; longer runs or more "
            "replicates make it narrower."
        )
    if all(table.designs for table in tables):
        return said
    said.append(
        f"Agree: the difference is as small as chance explains at {100 * errors.CONFIDENCE:g} % (Student's t). "
        f"Undecided: with these errors a difference of {100 * errors.COARSE:g} % could remain unseen; longer runs or "
        "more replicates make them smaller."
    )
    return said
