"""What the tests reach, after `make coverage`: build/coverage/c.txt and python.txt, pages of both, and the shares of
lines.

Ends with 1 if a half has fewer than 90 % of its lines, or if a line of the engine is not reached and
tests/uncovered.md does not say why: there, `file.c` heads a list whose items are lines of that file, as they are,
their function and a reason.
"""

import collections
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
TO = ROOT / "build/coverage"
LEAST = 90  # percent of the lines of either half


def run(*words, **options):
    return subprocess.run(words, cwd=ROOT, check=True, **options)


def measure_c():
    """Writes the reports on src/; returns (percent, {file: [text of each line of the engine that is not reached]})."""
    (TO / "c").mkdir(exist_ok=True)
    run(
        sys.executable, "-m", "gcovr", "--root", ".", "--filter", "src/", "build/cov",
        "--gcov-ignore-parse-errors=negative_hits.warn_once_per_file", "--gcov-suspicious-hits-threshold=0",
        "--txt", TO / "c.txt", "--html-details", TO / "c/index.html",
        "--json", TO / "c.json", "--json-summary", TO / "c-summary.json",
    )  # fmt: skip
    missed = {}
    for file in json.loads((TO / "c.json").read_text())["files"]:
        path = pathlib.Path(file["file"])
        if path.parts[:2] == ("src", "engine"):
            text = (ROOT / path).read_text().splitlines()
            reached = collections.Counter()  # of an inline function there is a count for each place
            for line in file["lines"]:
                reached[line["line_number"]] += line["count"]
            missed[path.name] = [text[number - 1].strip() for number in sorted(reached) if not reached[number]]
    return json.loads((TO / "c-summary.json").read_text())["line_percent"], missed


def measure_python():
    coverage = (sys.executable, "-m", "coverage")
    config = ("--rcfile", "tests/coverage.ini")
    run(*coverage, "combine", "-q", *config, TO)
    with open(TO / "python.txt", "w") as file:
        run(*coverage, "report", *config, stdout=file)
    run(*coverage, "html", "-q", *config, "-d", TO / "python")
    run(*coverage, "json", "-q", *config, "-o", TO / "python.json")
    totals = json.loads((TO / "python.json").read_text())["totals"]
    return 100 * totals["covered_lines"] / totals["num_statements"], totals["percent_covered"]


def reasons():
    """{file: [line, ...]} of tests/uncovered.md."""
    found, place = {}, None
    for line in (ROOT / "tests/uncovered.md").read_text().splitlines():
        if head := re.fullmatch(r"## `(\S+)`", line):
            place = found.setdefault(head[1], [])
        elif item := re.match(r"- `(.+?)` in `\w+`: \S", line):
            place.append(item[1])
    return found


def unexplained(missed, known):
    """Lines of C, as (file, text), that are not reached and have no reason; and those of reasons that are reached by
    now."""
    missed, known = (
        collections.Counter((name, line) for name, lines in these.items() for line in lines)
        for these in (missed, known)
    )
    return sorted((missed - known).elements()), sorted((known - missed).elements())


def main() -> int:
    python, with_branches = measure_python()
    c, missed = measure_c()
    open_, stale = unexplained(missed, reasons())
    for name, line in open_:
        print(f"not reached, and tests/uncovered.md does not say why: src/engine/{name}: {line}")
    for name, line in stale:
        print(f"reached, or gone: drop it from tests/uncovered.md: {name}: {line}")
    print(f"lines reached: C {c:.1f} %, Python {python:.1f} % ({with_branches:.1f} % with branches): build/coverage")
    return int(bool(open_) or min(c, python) < LEAST)


if __name__ == "__main__":
    sys.exit(main())
