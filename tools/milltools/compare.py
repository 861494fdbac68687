"""`mill compare`: runs side by side."""

from milltools.errors import UserError

SUMMARY = "Compares runs. Not in this version yet."


def add_arguments(parser):
    parser.add_argument("runs", nargs="+", help="output files")


def run(arguments) -> int:
    raise UserError("not in this version yet", status=1)
