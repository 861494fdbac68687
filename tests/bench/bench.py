#!/usr/bin/env python3
"""How fast millsim is, case by case, beside the figures it is to reach. `make bench` runs it.

Every case is measured several times; the table and the JSON file give median, least and greatest. Rates are per
second of processor time of one core. Small cases start a program for each repeat, in turn, so that a slow minute of
the machine spreads over all of them; large gases take long to start and repeat within one run. A figure that is not
reached is said so but is no failure: measuring is not a test.
"""

import argparse
import datetime
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile

from bench_cases import (
    CASES,
    HIGHER_IS_BETTER,
    ROOT,
    UNITS,
    BenchError,
    Programs,
    UsageError,
    chosen,
)

REPEATS = 5


# ---- measuring ----


def measure(cases, programs, say):
    """Samples of each case by name, and of the parts of those that are made of others."""
    names = {name for case in cases for name in (case.parts or (case.name,))}
    to_do = [case for case in CASES if case.name in names]
    samples = {case.name: [] for case in to_do}
    for turn in range(programs.repeats):
        for case in to_do:
            if turn == 0 or not case.once:
                say(f"repeat {turn + 1} of {programs.repeats}: {case.name}")
                samples[case.name] += case.measure(programs)
    for found in samples.values():
        for sample in found:
            if "contacts" in sample:
                sample["contacts_per_second"] = sample["contacts"] / sample["cpu"]
                sample["cpu_per_simulated_second"] = sample["cpu"] / sample["simulated"]
                sample["events_per_contact"] = sample["events"] / sample["contacts"]
    for case in cases:
        if case.parts:
            small, large = (samples[part] for part in case.parts)
            samples[case.name] = [
                {case.quantity: a["contacts_per_second"] / b["contacts_per_second"]}
                for a, b in zip(small, large, strict=True)
            ]
    return samples


def middle(samples, quantity):
    """Median; None where the samples do not have the quantity."""
    values = [sample[quantity] for sample in samples if sample.get(quantity) is not None]
    return statistics.median(values) if values else None


def is_met(value, wanted, quantity):
    return value >= wanted if quantity in HIGHER_IS_BETTER else value <= wanted


def record(case, samples, quick):
    """What the JSON file says of a case. Quick figures are not judged."""
    values = [sample[case.quantity] for sample in samples]
    aim_quantity = case.aim_quantity or case.quantity
    median = statistics.median(values)
    reached = is_met(median, case.at_least, case.quantity)
    aim_reached = is_met(middle(samples, aim_quantity), case.aim, aim_quantity)
    entry = {
        "name": case.name,
        "title": case.title,
        "quantity": case.quantity,
        "unit": UNITS[case.quantity][0],
        "better": "higher" if case.quantity in HIGHER_IS_BETTER else "lower",
        "median": median,
        "minimum": min(values),
        "maximum": max(values),
        "at_least": case.at_least,
        "at_least_met": None if quick else reached,
        "aim": case.aim,
        "aim_quantity": aim_quantity,
        "aim_met": None if quick else aim_reached,
    }
    for key in (
        "cpu_per_simulated_second",
        "contacts",
        "events",
        "events_per_contact",
        "balls",
        "packing",
        "bulk_packing",
        "peak_memory",
    ):
        entry[key] = middle(samples, key)
    return {**entry, "samples": samples}


def line_of(path, start):
    try:
        lines = pathlib.Path(path).read_text().splitlines()
    except OSError:
        return None
    return next((x.split(":", 1)[-1].strip() for x in lines if x.startswith(start)), None)


def build_facts(programs):
    """Compiler, flags and version of what is measured; the warnings' flags do not matter."""
    words = (line_of(programs.build / "flags", "") or "unknown").split()
    try:
        said = subprocess.run([words[0], "--version"], capture_output=True, text=True, check=True)
        compiler = said.stdout.splitlines()[0]
    except (OSError, subprocess.CalledProcessError):
        compiler = words[0]
    return {
        "version": programs.run("millsim", "--version")[0].strip(),
        "compiler": compiler,
        "flags": " ".join(word for word in words[1:] if not word.startswith(("-W", "-I"))),
    }


def machine_facts():
    caches = pathlib.Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")
    sizes = {f"L{line_of(c / 'level', '')} {line_of(c / 'type', '')}": line_of(c / "size", "") for c in sorted(caches)}
    return {
        "processor": line_of("/proc/cpuinfo", "model name") or platform.processor() or "unknown",
        "cores": os.cpu_count(),
        "caches": sizes,
        "system": platform.platform(),
    }


# ---- showing ----


def short(value):
    return "-" if value is None else f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def in_table(value, quantity):
    return short(value * UNITS[quantity][1])


def verdict(met):
    return {True: "met", False: "NOT met", None: "-"}[met]


def aligned(rows):
    """The lines of a table, columns as wide as they need to be."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()


def table(entries):
    """The lines of the table of all cases."""
    rows = [
        (
            *("case", "median", "(least .. greatest)", "", "at least", "", "aim", ""),
            *("CPU s/sim. s", "events/contact", "MB"),
        )
    ]
    for e in entries:
        quantity, aim_unit = e["quantity"], UNITS[e["aim_quantity"]][2]
        least, most = in_table(e["minimum"], quantity), in_table(e["maximum"], quantity)
        aim = in_table(e["aim"], e["aim_quantity"])
        megabytes = e["peak_memory"] and e["peak_memory"] / 1e6
        rows.append(
            (
                e["name"],
                in_table(e["median"], quantity),
                f"({least} .. {most})",
                UNITS[quantity][2],
                in_table(e["at_least"], quantity),
                verdict(e["at_least_met"]),
                aim if e["aim_quantity"] == quantity else f"{aim} {aim_unit}",
                verdict(e["aim_met"]),
                short(e["cpu_per_simulated_second"]),
                short(e["events_per_contact"]),
                short(megabytes),
            )
        )
    yield from aligned(rows)


def remarks(report):
    """What a reader of the table must know besides."""
    if report["quick"]:
        yield "Quick: too little work, and large gases with fewer balls; these figures mean nothing."
    else:
        for e in report["cases"]:
            packing, bulk = e["packing"], e["bulk_packing"]
            if packing and abs(bulk / packing - 1.0) > 0.02:
                yield f"{e['name']}: bulk packing is {bulk:.4f}, more than 2 % off {packing}"
        missed = [e["name"] for e in report["cases"] if not e["at_least_met"]]
        yield f"Below what it has to be at least: {', '.join(missed) or 'none'}."
    before, after = report["load_before"], report["load_after"]
    yield f"Load of the machine: {before:.2f} before, {after:.2f} after (1 is this measuring)."


def show_progress(text):
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)
    else:
        print(text, file=sys.stderr, flush=True)


def read_arguments():
    parser = argparse.ArgumentParser(prog="bench.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help="name of a case or its beginning")
    parser.add_argument("--list", action="store_true", help="name the cases and end")
    parser.add_argument("--quick", action="store_true", help="see that it works; figures are void")
    parser.add_argument("--repeats", type=int, help=f"default {REPEATS}; 1 with --quick")
    parser.add_argument(
        "--json",
        type=pathlib.Path,
        metavar="FILE",
        help="default build/bench.json; build/bench-quick.json with --quick",
    )
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release", help="where the programs are")
    arguments = parser.parse_args()
    if arguments.repeats is not None and arguments.repeats < 1:
        raise UsageError("--repeats: at least 1")
    return arguments


def begin(programs, path, usual):
    """Where the report goes, and what it says of the machine and of what is measured."""
    target = (path or ROOT / "build" / f"{usual}{'-quick' * programs.quick}.json").resolve()
    if not target.parent.is_dir():
        raise BenchError(f"{target}: no such folder")
    return target, {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "quick": programs.quick,
        "repeats": programs.repeats,
        "machine": machine_facts(),
        "load_before": os.getloadavg()[0],
        "build": build_facts(programs),
    }


def finish(report, target, lines):
    """Shows the lines of a report and writes it."""
    print("\n".join(lines))
    try:
        target.write_text(json.dumps(report, indent=1) + "\n")
    except OSError as error:
        raise BenchError(f"{target}: {error.strerror}") from None
    print(f"Written: {target}")


def bench(arguments):
    cases = chosen(arguments.cases)
    repeats = arguments.repeats or (1 if arguments.quick else REPEATS)
    with tempfile.TemporaryDirectory(prefix="millsim-bench-") as folder:
        programs = Programs(arguments.build.resolve(), arguments.quick, repeats, folder)
        target, report = begin(programs, arguments.json, "bench")
        samples = measure(cases, programs, show_progress)
    if sys.stderr.isatty():
        show_progress("")
    report["load_after"] = os.getloadavg()[0]
    report["cases"] = [record(case, samples[case.name], arguments.quick) for case in cases]
    finish(report, target, [*table(report["cases"]), "", *remarks(report)])


def main():
    try:
        arguments = read_arguments()
        if arguments.list:
            print("\n".join(f"{case.name:<16}{case.title}" for case in CASES))
        else:
            bench(arguments)
    except BenchError as error:
        print(f"bench.py: {error}", file=sys.stderr)
        return error.status
    return 0


if __name__ == "__main__":
    sys.exit(main())
