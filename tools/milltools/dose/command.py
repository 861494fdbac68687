"""`mill dose`: the dose of a run as a table."""

from milltools.base.answer import Answer
from milltools.base.progress import say
from milltools.base.text import columns
from milltools.dose import dose
from milltools.read.runfile import Run

SUMMARY = (
    "Says what the impacts of a run do to the powder: power for each kilogram of balls and of powder, dose, energy and "
    "number of impacts, hard impacts, powder caught, rate of a reaction or breakage, temperatures. Powder and heat are "
    "described in the sections [powder] and [heat] of the deck, or with -s; docs/dose.md has the formulas."
)


def add_arguments(parser):
    parser.add_argument("run", metavar="RUN", help="output file of a run")
    parser.add_argument(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="a value of [powder] or [heat] for this run, such as 'powder.mass=20 g'; may be repeated",
    )  # fmt: skip


def run(arguments) -> Answer:
    with Run(arguments.run) as opened:
        found = dose.rows(opened, arguments.set)
        for note in opened.notes:
            say("mill dose", f"note: {note}")
    cells = [(row.name, dose.measured(row), row.words) for row in found]
    text = "\n".join(columns([("", "value ± standard error", ""), *cells], left=(0, 2)))
    results = {
        row.name: {"value": row.value, "standard_error": row.error, "unit": row.unit, "meaning": row.words}
        for row in found
    }
    return Answer(text, {"run": arguments.run, "files": [], "results": results})
