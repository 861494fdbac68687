#!/usr/bin/env python3
"""millsim held against LIGGGHTS: runs the parts of this folder and writes RESULTS.md, its figures, and README's short form.

validate.py [PART ...] [--kept]      ends with 1 when a claim is outside its band
"""

import argparse
import importlib
import pathlib
import re
import sys
import tempfile
import time
import traceback

import matplotlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
matplotlib.use("Agg")

import ladder
from runs import DemCase, say

# In this order: what a contact is, what it does to a mill, what to expect elsewhere. Modules of each part.
PARTS = {
    "ladder": ("impacts", "isolated"),
    "transient": ("transient",),
    "steady": ("steady",),
    "other": ("other",),
    "price": ("price",),
}


def run_part(name, kept):
    """Runs one part; what went wrong is a result like any other."""
    result = {"name": name, "claims": [], "told": [], "titles": [], "failure": None}
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix=f"millsim-{name}-") as scratch:
        case = DemCase(HERE, pathlib.Path(scratch), kept)
        try:
            for module in PARTS[name]:
                module = importlib.import_module(module)
                result["titles"].append(module.__doc__.strip().splitlines()[0].rstrip("."))
                module.check(case)
        except Exception:
            result["failure"] = traceback.format_exc()
        result["claims"], result["told"] = case.claims, case.told
        result["figures"] = sorted(case.figures)
    held = sum(claim.holds for claim in case.claims)
    seconds = time.monotonic() - begin
    say(f"dem: {name}: {held} of {len(case.claims)} claims hold, {seconds:.0f} s")
    for claim in case.claims:
        expected = "" if claim.expected is None else f" expected {claim.expected:.5g}"
        error = "" if claim.error is None else f" +- {claim.error:.2g}"
        say(
            f"    {'yes' if claim.holds else 'NO '} {claim.what}: {claim.measured:.5g}{error}{expected} "
            f"band {claim.band:.3g} [{claim.unit}] ({claim.against})"
        )
    if result["failure"]:
        say(result["failure"])
    return result


def write_results(results, path):
    claims = [claim for result in results for claim in result["claims"]]
    held = sum(claim.holds for claim in claims)
    lines = [
        "# Held against LIGGGHTS",
        "",
        f"Written by `make validate-dem`: {held} of {len(claims)} claims hold. [README.md](README.md) says what is compared and "
        "why so. Deviations are millsim over LIGGGHTS less 1; *band* is what they may be, *error* their standard error.",
        "",
    ]
    for result in results:
        lines += [f"## {result['name'].capitalize()}", ""]
        lines += [f"{title}.\n" for title in result["titles"]]
        if result["failure"]:
            lines += ["**It failed:**", ""]
            lines += ["    " + line for line in result["failure"].rstrip().splitlines()] + [""]
        lines += [*ladder.claims_table(result["claims"]), ""]
        lines += [f"- {sentence}" for sentence in result["told"]] + [""]
        lines += [f"![{figure}]({figure})\n" for figure in result["figures"]]
    text = re.sub("\n{3,}", "\n\n", "\n".join(lines))
    path.write_text(text.rstrip() + "\n")


def write_short_form(results, path):
    rows = ["| claim | against | expected | measured | part |", "| --- | --- | --- | --- | --- |"]
    for result in results:
        link = f"[{result['name']}](validation/dem/RESULTS.md#{result['name']})"
        rows += ladder.headlines(result["claims"], link)
    ladder.put_between(path, "dem", "make validate-dem", rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "part", nargs="*", help=f"of {', '.join(PARTS)}; default: all, and only then RESULTS.md"
    )
    parser.add_argument(
        "--kept", action="store_true", help="take kept runs of LIGGGHTS whatever version made them"
    )
    arguments = parser.parse_args()
    names = arguments.part or list(PARTS)
    for name in names:
        if name not in PARTS:
            parser.error(f"no part '{name}'; there are {', '.join(PARTS)}")
    begin = time.monotonic()
    results = []
    for k, name in enumerate(names, 1):
        say(f"dem: part {k} of {len(names)}: {name}")
        try:
            results.append(run_part(name, arguments.kept))
        except KeyboardInterrupt:
            say("dem: stopped")
            return 130
    if not arguments.part:
        write_results(results, HERE / "RESULTS.md")
        write_short_form(results, ladder.ROOT / "README.md")
        say(f"dem: {time.monotonic() - begin:.0f} s; validation/dem/RESULTS.md written")
    good = all(
        not r["failure"] and r["claims"] and all(c.holds for c in r["claims"]) for r in results
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
