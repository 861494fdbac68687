#!/usr/bin/env python3
"""The verification ladder: runs every case of this folder and writes RESULTS.md and its figures.

A case is a folder with a deck, a README.md (claim, source, tolerance) and a check.py whose check(case) runs
millsim, works out what it measures, and states claims. The first line of check.py's docstring is its title.

    ladder.py [CASE ...] [--jobs N]      exit status 1 if a claim is outside its band and no reason is known
"""

import argparse
import concurrent.futures
import contextlib
import dataclasses
import datetime
import importlib.util
import math
import multiprocessing
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time
import traceback

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = pathlib.Path(os.environ.get("MILLSIM", ROOT / "millsim"))
HERE = ROOT / "validation"
# The order of the ladder: each rung stands on those before it
CASES = [
    "single",
    "gas",
    "dense",
    "cooling",
    "balances",
    "invariances",
    "sensitivities",
    "precision",
    "forecast",
    "experiments",
    "jars",
]
TIMED = ["forecast"]  # compare processor times: one at a time, after all others


@dataclasses.dataclass
class Claim:
    """One sentence held against a number."""

    what: str
    against: str  # theory, paper, equation
    measured: float
    expected: float | None  # None: the claim is a bound on `measured` alone
    band: float  # allowed |measured - expected|, or the bound
    error: float | None  # standard error of `measured`
    unit: str
    headline: bool  # is in the summary at the top of RESULTS.md
    known: str = ""  # why it is known not to hold; then holding it is the surprise

    @property
    def holds(self) -> bool:
        off = self.measured - (0.0 if self.expected is None else self.expected)
        return math.isfinite(off) and abs(off) <= self.band

    @property
    def as_known(self) -> bool:
        """Holds, or fails with a reason that is told."""
        return self.holds != bool(self.known)


class Case:
    """What check.py works with: runs decks in a scratch folder, gathers claims, saves the figure."""

    def __init__(self, folder: pathlib.Path, scratch: pathlib.Path):
        self.folder = folder
        self.scratch = scratch
        self.program = PROGRAM
        self.claims: list[Claim] = []
        self.runs = 0
        self.contacts = 0

    def write(self, name: str, text: str) -> pathlib.Path:
        """A file for a run: a start file or a deck of its own."""
        path = self.scratch / name
        path.write_text(text)
        return path

    def run(self, deck: str | pathlib.Path = "deck.ini", output: str | None = None, **settings) -> pathlib.Path:
        """Runs a deck of the case's folder, or a path, and returns the output file.

        settings: deck values with `__` for the dot: run(run__time="1 s", contact__ball_ball__friction=0). One start
        unless they say otherwise.
        The summary that --json prints is saved beside the output as .json.
        """
        self.runs += 1
        deck = self.folder / deck
        path = self.scratch / (output or f"run{self.runs}.h5")
        settings = {"run__starts": 1} | settings  # cases choose their own seeds
        options = [f"--set={key.replace('__', '.')}={value}" for key, value in settings.items()]
        result = subprocess.run(
            [self.program, "--json", "--quiet", "--force", "-o", path, *options, deck],
            cwd=self.scratch,
            capture_output=True,
            text=True,
            check=False,
        )
        if result.returncode != 0:
            raise RuntimeError(f"millsim {' '.join(options)} {deck}: {result.stderr.strip()}")
        path.with_suffix(".json").write_text(result.stdout)
        return path

    def claim(
        self,
        what,
        measured,
        expected,
        band,
        *,
        against,
        error=None,
        unit="1",
        headline=False,
        known="",
    ):
        """`measured` lies within `band` of `expected`; it is `known` why, if it does not."""
        self.claims.append(
            Claim(
                what,
                against,
                float(measured),
                float(expected),
                float(band),
                _number(error),
                unit,
                headline,
                known,
            )
        )

    def bound(self, what, measured, limit, *, against, error=None, unit="1", headline=False, known=""):
        """|measured| is at most `limit`; it is `known` why, if it is not."""
        self.claims.append(
            Claim(
                what,
                against,
                float(measured),
                None,
                float(limit),
                _number(error),
                unit,
                headline,
                known,
            )
        )

    def save(self, figure, name: str = "figure.png"):
        """Saves a matplotlib figure into the case's folder, without dates, so that equal runs give equal files."""
        figure.savefig(self.folder / name, dpi=110, metadata={"Software": None})


def _number(value):
    return None if value is None else float(value)


def run_case(name: str) -> dict:
    """Runs one case in this process; what went wrong is a result like any other."""
    folder = HERE / name
    started = time.monotonic()
    spec = importlib.util.spec_from_file_location(f"check_{name}", folder / "check.py")
    result = {"name": name, "title": name, "claims": [], "failure": None}
    with contextlib.suppress(ImportError):
        import matplotlib

        matplotlib.use("Agg")
    with tempfile.TemporaryDirectory(prefix=f"millsim-{name}-") as scratch:
        case = Case(folder, pathlib.Path(scratch))
        try:
            module = importlib.util.module_from_spec(spec)
            sys.path.insert(0, str(HERE))
            spec.loader.exec_module(module)
            result["title"] = (module.__doc__ or name).strip().splitlines()[0].rstrip(".")
            module.check(case)
        except Exception:
            result["failure"] = traceback.format_exc()
        result["claims"] = [dataclasses.asdict(claim) for claim in case.claims]
    result["seconds"] = time.monotonic() - started
    return result


def show(value: float | None, digits: int = 5) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def cell(text: str) -> str:
    return text.replace("|", "\\|")


def with_unit(text: str, unit: str) -> str:
    return text if unit == "1" or not text else f"{text} {unit}"


def figures(case: dict) -> list[str]:
    return sorted(path.name for path in (HERE / case["name"]).glob("*.png"))


def verdict_of(claim: Claim) -> str:
    """yes, NO, or NO with the reason that is known."""
    if claim.holds:
        return "yes, against what is known" if claim.known else "yes"
    return f"**NO**: {claim.known}" if claim.known else "**NO**"


def claims_table(claims: list[Claim]) -> list[str]:
    """The claims as lines of a Markdown table; none of none."""
    if not claims:
        return []
    lines = [
        "| claim | compared with | expected | measured | error | band | holds |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for claim in claims:
        band = f"<= {show(claim.band, 3)}" if claim.expected is None else f"+- {show(claim.band, 2)}"
        row = [
            cell(claim.what),
            cell(claim.against),
            with_unit(show(claim.expected), claim.unit),
            with_unit(show(claim.measured), claim.unit),
            show(claim.error, 2),
            band,
            cell(verdict_of(claim)),
        ]
        lines.append("| " + " | ".join(row) + " |")
    return lines


def stamp() -> str:
    """With what a table of results was written: version, day, machine; one sentence."""
    said = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True, check=True).stdout.split()
    system = platform.freedesktop_os_release()["PRETTY_NAME"] if sys.platform == "linux" else platform.platform()
    model = platform.processor() or platform.machine()
    with contextlib.suppress(OSError):
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), model)
    return f"Written with millsim {said[1]} on {datetime.date.today()}: {system}, {os.cpu_count()} cores, {model}."


def write_results(cases: list[dict], path: pathlib.Path) -> None:
    claims = [Claim(**claim) for case in cases for claim in case["claims"]]
    held = sum(claim.holds for claim in claims)
    lines = [
        "# The verification ladder",
        "",
        f"Written by `make validate`: {held} of {len(claims)} claims hold. *Band*: largest accepted difference "
        "between the measured and the expected value or, where no value is expected, the largest accepted value; "
        "*error*: standard error of the measured value.",
        "",
        stamp(),
        "",
        "## In short",
        "",
        *summary(cases),
        "",
    ]
    for case in cases:
        lines += [
            f"## {case['title']}",
            "",
            f"[The claims and their reasons]({case['name']}/README.md)",
            "",
        ]
        if case["failure"]:
            lines += [
                "**The case failed:**",
                "",
                *("    " + line for line in case["failure"].rstrip().splitlines()),
                "",
            ]
        lines += claims_table([Claim(**claim) for claim in case["claims"]])
        lines.append("")
        lines += [f"![{case['title']}]({case['name']}/{figure})\n" for figure in figures(case)]
    path.write_text("\n".join(lines).rstrip() + "\n")


def headlines(claims: list[Claim], link: str) -> list[str]:
    """The claims that are headlines, as rows of a Markdown table whose last column is `link`."""
    rows = []
    for claim in claims:
        if not claim.headline:
            continue
        error = f" +- {show(claim.error, 2)}" if claim.error else ""
        either = " in size" if claim.expected is None and claim.measured < 0 else ""
        expected = (
            f"at most {show(claim.band, 3)}"
            if claim.expected is None
            else f"{show(claim.expected)} +- {show(claim.band, 2)}"
        )
        why = f": {cell(claim.known)}" if claim.known else ""
        verdict = "" if claim.holds else f" **(outside{why})**"
        rows.append(
            f"| {cell(claim.what)} | {cell(claim.against)} | {with_unit(expected, claim.unit)}{either} "
            f"| {with_unit(show(claim.measured) + error, claim.unit)}{verdict} | {link} |"
        )
    return rows


def summary(cases: list[dict]) -> list[str]:
    """The headlines of all cases as a Markdown table."""
    rows = ["| claim | compared with | expected | measured | case |", "| --- | --- | --- | --- | --- |"]
    for case in cases:
        claims = [Claim(**claim) for claim in case["claims"]]
        rows += headlines(claims, f"[{case['name']}]({case['name']}/README.md)")
    return rows


def tell(result: dict, fully: bool) -> None:
    """Prints how many claims of a case hold, and those that do not; fully: all of them."""
    claims = [Claim(**claim) for claim in result["claims"]]
    state = f"{sum(c.holds for c in claims)} of {len(claims)} claims hold"
    print(f"ladder: {result['name']:14} {state}, {result['seconds']:.0f} s", flush=True)
    for claim in claims:
        if not claim.holds or fully:
            expected = "" if claim.expected is None else f", expected {claim.expected:.6g}"
            error = "" if claim.error is None else f" +- {claim.error:.2g}"
            print(
                f"    {'yes' if claim.holds else 'NO '} {claim.what}: {claim.measured:.6g}{error}"
                f"{expected}, band {claim.band:.3g} [{claim.unit}]",
                flush=True,
            )
    if result["failure"]:
        print(result["failure"], flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="*", help=f"{', '.join(CASES)}; default: all; RESULTS.md is written only for all")
    parser.add_argument(
        "--jobs",
        type=int,
        default=os.cpu_count(),
        help="number of cases that run at the same time (default: number of cores)",
    )
    arguments = parser.parse_args()
    names = arguments.case or CASES
    for name in names:
        if name not in CASES:
            parser.error(f"no case '{name}'; there are {', '.join(CASES)}")
    started = time.monotonic()
    results = {}
    print(f"ladder: {len(names)} cases, at most {arguments.jobs} at the same time", flush=True)
    # a process for each case: modules of one folder must not be taken for those of another
    pool_of = concurrent.futures.ProcessPoolExecutor
    spawn = multiprocessing.get_context("spawn")
    rounds = [[name for name in names if name not in TIMED], *([name] for name in names if name in TIMED)]
    for together in rounds:
        with pool_of(arguments.jobs, mp_context=spawn, max_tasks_per_child=1) as pool:
            futures = {pool.submit(run_case, name): name for name in together}
            for future in concurrent.futures.as_completed(futures):
                result = future.result()
                results[result["name"]] = result
                tell(result, bool(arguments.case))
    ordered = [results[name] for name in CASES if name in results]
    good = all(not r["failure"] and r["claims"] and all(Claim(**c).as_known for c in r["claims"]) for r in ordered)
    if not arguments.case:
        write_results(ordered, HERE / "RESULTS.md")
        print(f"ladder: {time.monotonic() - started:.0f} s; validation/RESULTS.md written", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
