"""`mill dem`: the same deck as soft spheres."""

from milltools.errors import UserError

SUMMARY = "Runs a deck in LIGGGHTS, as soft spheres. Not in this version yet."


def add_arguments(parser):
    parser.add_argument("deck", help="the deck")


def run(arguments) -> int:
    raise UserError("not in this version yet", status=1)
