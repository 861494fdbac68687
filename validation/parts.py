"""A comparison of several parts: runs them one after another, writes RESULTS.md.

A part is a list of modules with a docstring (its first line is a title) and check(case), which states claims. The
case also tells sentences with figures and remembers the figures it saved. Used by dem/, study/ and paper/; the ladder
itself runs its cases in parallel.
"""

import argparse
import importlib
import pathlib
import re
import tempfile
import time
import traceback

import ladder


def say(text):
    """A line of progress."""
    print(text, flush=True)


class Part(ladder.Case):
    """The ladder's case, with sentences for the results and the names of the figures saved."""

    def __init__(self, folder, scratch):
        super().__init__(folder, scratch)
        self.told = []
        self.figures = set()

    def table(self):
        """The claims as lines of Markdown."""
        return ladder.claims_table(self.claims)

    def tell(self, sentence):
        """A sentence with figures, below the table of claims."""
        self.told.append(sentence)
        say(f"      {sentence}")

    def save(self, figure, name):
        super().save(figure, name)
        self.figures.add(name)


def run_part(mark, name, modules, make_case):
    """Runs one part; what went wrong is a result like any other."""
    result = {"name": name, "claims": [], "told": [], "titles": [], "failure": None}
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix=f"millsim-{name}-") as scratch:
        case = make_case(pathlib.Path(scratch))
        try:
            for module in modules:
                module = importlib.import_module(module)
                result["titles"].append(module.__doc__.strip().splitlines()[0].rstrip("."))
                module.check(case)
        except Exception:
            result["failure"] = traceback.format_exc()
        result["claims"], result["told"] = case.claims, case.told
        result["table"] = case.table()
        result["figures"] = sorted(case.figures)
    held = sum(claim.holds for claim in case.claims)
    seconds = time.monotonic() - begin
    say(f"{mark}: {name}: {held} of {len(case.claims)} claims hold, {seconds:.0f} s")
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


def counted(claims):
    """The sentence that begins the results."""
    return f"{sum(claim.holds for claim in claims)} of {len(claims)} claims hold."


def write_results(title, writer, introduction, results, path, counted, summary):
    claims = [claim for result in results for claim in result["claims"]]
    lines = [
        f"# {title}",
        "",
        f"Written by `{writer}`: {counted(claims)} {introduction}",
        "",
        ladder.stamp(),
        "",
        "## In short",
        "",
        *summary(results),
        "",
    ]
    for result in results:
        lines += [f"## {result['name'].capitalize()}", ""]
        lines += [f"{title}.\n" for title in result["titles"]]
        if result["failure"]:
            lines += ["**This part failed:**", ""]
            lines += ["    " + line for line in result["failure"].rstrip().splitlines()] + [""]
        lines += [*result["table"], ""]
        lines += [f"- {sentence}" for sentence in result["told"]] + [""]
        lines += [f"![{figure}]({figure})\n" for figure in result["figures"]]
    text = re.sub("\n{3,}", "\n\n", "\n".join(lines))
    path.write_text(text.rstrip() + "\n")


def summary(results):
    """The headlines as lines of a Markdown table."""
    rows = ["| claim | compared with | expected | measured | part |", "| --- | --- | --- | --- | --- |"]
    for result in results:
        link = f"[{result['name']}](#{result['name']})"
        rows += ladder.headlines(result["claims"], link)
    return rows


def main(
    description,
    kept,
    folder,
    title,
    introduction,
    parts,
    make_case,
    counted=counted,
    summary=summary,
):
    """Reads the command line and runs the parts named there (none: all, and only then results are written); the exit
    status.

    description: of the command; kept: what --kept uses whatever version made it; folder: the comparison's, of the
    name of its target `make validate-NAME`; parts: name -> modules; make_case(folder, scratch, kept) gives what
    check() works with; counted(claims), summary(results): the first sentence of the results, and the table below it.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("part", nargs="*", help=f"{', '.join(parts)}; default: all; RESULTS.md is written only for all")
    parser.add_argument(
        "--kept", action="store_true", help=f"use the kept {kept}, whatever version of millsim made them"
    )
    asked = parser.parse_args()
    mark, names = folder.name, asked.part
    for name in names:
        if name not in parts:
            say(f"{mark}: no part '{name}'; the parts are {', '.join(parts)}")
            return 2
    begin = time.monotonic()
    results = []
    chosen = names or list(parts)
    for k, name in enumerate(chosen, 1):
        say(f"{mark}: part {k} of {len(chosen)}: {name}")
        try:
            results.append(run_part(mark, name, parts[name], lambda at: make_case(folder, at, asked.kept)))
        except KeyboardInterrupt:
            say(f"{mark}: stopped")
            return 130
    if not names:
        writer = f"make validate-{mark}"
        path = folder / "RESULTS.md"
        write_results(title, writer, introduction, results, path, counted, summary)
        say(f"{mark}: {time.monotonic() - begin:.0f} s; validation/{mark}/RESULTS.md written")
    good = all(not r["failure"] and r["claims"] and all(c.as_known for c in r["claims"]) for r in results)
    return 0 if good else 1
