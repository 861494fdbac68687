"""The tables of a report: rows of (head, cells), every cell a text or a Number."""

import math

from milltools.base.text import Number, count, lines, plain, scaled, share, small, with_error
from milltools.read import kinds, motions
from milltools.report import facts

CONTACT_HEADS = (
    "contacts",
    "rate",
    "median v\N{LATIN SUBSCRIPT SMALL LETTER N} of all",
    "median v\N{LATIN SUBSCRIPT SMALL LETTER N} above 50 mm/s",
    "mean v\N{LATIN SUBSCRIPT SMALL LETTER N}",
    "at the rebound floor",
    "dissipated power",
    "share",
)


ENERGIES = {
    "kinetic_energy": "kinetic energy",
    "rotational_energy": "energy in the balls' spin",
    "potential_energy": "potential energy",
    "elastic_energy": "energy in the springs of contacts",
}


def contacts(run) -> list[tuple[str, list[Number]]]:
    """By kind, then all; kinds that did not meet are left out, as on the terminal."""
    found = []
    total = float(run.statistic("impacts/all/dissipated_power"))
    for row in (*run.kinds, "all"):
        one = f"impacts/{row}"
        times = int(run.statistic(f"{one}/count"))
        if not times and row != "all":
            continue
        power = float(run.statistic(f"{one}/dissipated_power"))
        normal = f"{one}/normal_speed"
        found.append(
            (
                kinds.label(row),
                [
                    count(times),
                    scaled(run.statistic(f"{one}/rate"), "/s"),
                    scaled(run.statistic(f"{normal}/median"), "m/s"),
                    scaled(run.statistic(f"{normal}/median_above_50mm_s"), "m/s"),
                    scaled(run.statistic(f"{normal}/mean"), "m/s"),
                    share(float(run.statistic(f"floor_share/{row}"))),
                    scaled(power, "W"),
                    share(power / total if total > 0 else math.nan),
                ],
            )
        )
    return found


def strikes(run) -> str:
    """How many contacts there are when a pair's re-contacts count once; empty where none are merged."""
    window = run.quantity("output/strike_window", 0.0)
    if not window > 0 or not run.has("statistics/strikes/all/count"):
        return ""
    times, rate = run.statistic("strikes/all/count"), run.statistic("strikes/all/rate")
    return f"{count(times)} strikes ({scaled(rate, '/s')}) when re-contacts of a pair within {scaled(window, 's')} are merged."


def motion_rows(run) -> list[tuple[str, Number, str]]:
    """What each motion gives, and how it goes."""
    found = []
    for name in run.motions:
        power, torque = (facts.mean(run, f"motions/{name}/{what}", unit) for what, unit in facts.DRIVE)
        if power is not None:
            words = plain(motions.words(run, name)) + (f"; torque {torque}" if torque and torque.value else "")
            found.append((f"power of {plain(name)}", power, words))
    return found


def balance(run) -> list[tuple[str, object, str]]:
    """(what, value, remark): drive, energies, account."""
    found = []
    for name, unit in facts.DRIVE:
        mean = facts.mean(run, f"{run.driven}/{name}", unit)
        if mean is not None:
            found.append((f"{run.driven} {name}", mean, facts.drive_remark(run)))
    if run.driven == "drive":
        found += motion_rows(run)
    if facts.sampled(run) and run.has(f"statistics/{run.driven}/pinch_power"):
        pinches = run.statistic(f"{run.driven}/pinch_power")
        if pinches > 0:
            found.append(("pinches", scaled(pinches, "W"), f"part of the {run.driven} power, on balls that moving bodies press"))  # fmt: skip
    for name, label, what, unit in (
        ("median", "median normal speed", "all impacts", "m/s"),
        ("median_above_50mm_s", "median normal speed", "impacts above 50 mm/s", "m/s"),
        ("rate_above_1/all", "rate", "impacts above 1 m/s", "/s"),
    ):
        known = run.known(name)
        if known and facts.sampled(run):
            remark = what if math.isfinite(known[1]) else f"{what}: error not known"
            found.append((label, with_error(*known[:2], unit), remark))
    if facts.sampled(run):
        lost = scaled(run.statistic("impacts/all/dissipated_power"), "W")
        found.append(("dissipated power", lost, "all contacts, over the sampled window"))
    for name, label in ENERGIES.items():
        time, value = run.series(name) if run.has_series(name) else ((), ())
        if len(value) and math.isfinite(value[-1]):
            found.append((label, scaled(value[-1], "J"), f"at {scaled(time[-1], 's')}"))
    if run.has("run/energy_balance_error") and run.has("run/energy_turnover"):
        turned, error = (float(run.read(f"run/energy_{n}")) for n in ("turnover", "balance_error"))
        remark = f"of {scaled(turned, 'J')} turned over ({small(error)})"
        found.append(("energy error", scaled(error * turned, "J"), remark))
    return found


def precision(run) -> list[tuple[str, object, str]]:
    """How well is known what decided when the run ended; empty without run.precision."""
    if not run.has("statistics/precision/asked"):
        return []

    def value(name):
        return float(run.statistic(f"precision/{name}"))

    found = [("asked for", share(value("asked")), "run.precision: standard error over value")]
    for name, label, unit in (
        ("median_above_50mm_s", "median normal speed above 50 mm/s", "m/s"),
        (f"{run.driven}_power", f"{run.driven} power", "W"),
    ):
        if not run.has(f"statistics/precision/{name}/value"):
            continue
        mean, error = value(f"{name}/value"), value(f"{name}/standard_error")
        known = f"{100 * error / abs(mean):.2g} % of it" if mean and math.isfinite(error) else "error not known"
        found.append((label, with_error(mean, error, unit), known))
    return [
        *found,
        ("start-up cut away", scaled(value("warm_up"), "s"), "the sampled window begins there"),
        ("length of a batch", scaled(value("batch"), "s"), f"{value('batches'):.0f} of them"),
        ("start-up is over", "yes" if value("settled") else "not known", ""),
        ("known as well as asked", "yes" if value("reached") else "no", _ended(run)),
    ]


def _ended(run) -> str:
    words = {
        "time": "the run ended at run.time",
        "precision": "the run ended because it was",
        "max_collisions": "the run ended at run.max_collisions",
        "none": "the run is not complete",
    }
    said = run.read("run/ended_by") if run.has("run/ended_by") else ""
    return words.get(said, plain(said))


def how(run, size: int) -> list[tuple[str, object, str]]:
    """Program, machine-independent facts, cost; `size` of the file [byte]."""
    found = [("program", plain(run.program), plain(run.version))]
    for name in ("compiler", "flags", "hdf5", "gsl", "command", "started", "status"):
        if run.has(f"run/{name}"):
            found.append(({"hdf5": "HDF5", "gsl": "GSL"}.get(name, name), plain(run.read(f"run/{name}")), ""))
    if _ended(run):
        found.append(("end", _ended(run), ""))
    found.append(("simulated", scaled(run.time, "s"), f"{len(run.frame_times())} frames stored"))
    for name, label, unit in (
        ("wall_time", "time on the wall's clock", "s"),
        ("cpu_time", "processor time", "s"),
        ("peak_memory", "memory at most", "B"),
    ):
        if run.has(f"run/{name}"):
            found.append((label, scaled(run.read(f"run/{name}"), unit), ""))
    if math.isfinite(run.cost):
        cpu = float(run.read("run/cpu_time"))
        rate = f"{scaled(run.contacts / cpu, '')} contacts per processor second" if cpu > 0 else ""
        found.append(("price", Number(f"{run.cost:.4g} s/s", run.cost),
                      "processor seconds per simulated second" + (f"; {rate}" if rate else "")))  # fmt: skip
    found.append(("file", plain(run.path), str(scaled(size, "B"))))
    return found


def everything(run) -> list[tuple[str, str, str, str]]:
    """(name, value, unit, meaning) of all that /run holds, but for counts of contacts that the mill cannot have."""
    found = []
    for path, unit, meaning in run.datasets("run"):
        if path.split("/")[-1] in run.absent:
            continue
        value = run.read(path)
        shown = lines(value) if isinstance(value, str) else f"{value:.10g}"
        found.append((path.removeprefix("run/"), shown, unit, meaning))
    return found
