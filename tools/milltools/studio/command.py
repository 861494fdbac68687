"""`mill studio`: a page in which a ball mill turns, simulated by the engine in the browser.

`make studio` builds the page (build.py); an installed package brings it.
"""

import base64
import json
import os
import pathlib
import webbrowser
import zlib

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable, opened, write_text
from milltools.base.text import plain, size
from milltools.read import deck_text, values
from milltools.read.deck import Deck

SUMMARY = (
    "Opens a page in the browser in which a ball mill turns: simulated live, with sliders for the design, the power "
    "and its error, the energies of the impacts and the energy balance. The page is one file that needs no network."
)
OWN = '<script type="application/json" id="own">null</script>'  # in the page: the deck to begin with
LONGEST = 30_000  # characters of a link; browsers cut longer ones
MOST = 16_000_000  # bytes of all files in a page


def add_arguments(parser):
    parser.add_argument("deck", nargs="?", metavar="DECK", help="the mill to begin with; default: the reference mill")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="write the page, with DECK and the files of its folder that it names, instead of opening it",
    )


def run(arguments) -> Answer:
    page = built()
    text = deck_text.read_text(arguments.deck) if arguments.deck else None
    files = named(arguments.deck, text) if text else {}
    if arguments.output:
        return _write(page, arguments.output, arguments.deck, text, files)
    if files:
        first = plain(next(iter(files)))
        raise UserError(f"{arguments.deck}: needs {first}: write a page that has both with -o FILE.html")
    address = page.as_uri() + (f"#design={packed(text)}" if text else "")
    if len(address) > LONGEST:
        raise UserError(f"{arguments.deck}: is too long for a link: write a page that has it with -o FILE.html")
    said = f"{page}: opened in the browser" if _open(address) else address
    return Answer(said, {"files": [], "page": page, "link": address})


def built() -> pathlib.Path:
    """The built page; UserError if it is missing."""
    page = pathlib.Path(__file__).with_name("studio.html")
    if not page.exists():
        raise UserError(f"{page}: is missing: run 'make studio' in the checkout of millsim", status=1)
    return page


def packed(text: str) -> str:
    """A deck as the text of a link, as deck.js reads it."""
    press = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = press.compress(json.dumps({"deck": text}).encode()) + press.flush()
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


def named(path: str, text: str) -> dict[str, bytes]:
    """{name: content} of the files that a deck names, such as meshes. The page is made to be shared, and the deck may
    be a stranger's: so a file outside of the deck's folder, one to which a link leads out of it, and one that millsim
    does not read as what the deck names it for, are UserErrors."""
    folder, found, entries = os.path.realpath(pathlib.Path(path).parent), {}, deck_text.entries(text, path)
    try:
        told = values.tell(f"{one.section}.{one.key}={one.value}" for one in entries)
    except UserError:
        Deck.check(path)  # says where
        raise
    for entry, value in zip(entries, told):
        if not value.is_file or entry.value in found:
            continue
        place, name = os.path.realpath(os.path.join(folder, entry.value)), f"'{plain(entry.value)}'"
        if os.path.isabs(entry.value) or os.path.commonpath([folder, place]) != folder:
            raise entry.fault(f"{name} is not in the deck's folder, and a page takes no other file: copy it there")
        try:
            with opened(place, "a file for a page") as file:
                found[entry.value] = file.read(MOST + 1)
        except UserError as fault:
            raise entry.fault(fault) from None
        if sum(map(len, found.values())) > MOST:
            raise entry.fault(f"{name}: the files of a page have {size(MOST)} at most; write a smaller one")
    if found:
        Deck.check(path)
    return found


def _write(page, output, deck, text, files) -> Answer:
    if pathlib.Path(output).exists():
        raise UserError(f"{output}: exists; give another name, or remove it")
    check_writable(output)
    whole = page.read_text("utf-8")
    if text:
        held = {name: base64.b64encode(content).decode() for name, content in files.items()}
        own = json.dumps({"text": text, "files": held}).replace("<", "\\u003c")
        whole = whole.replace(OWN, OWN.replace("null", own, 1), 1)
    write_text(output, whole)
    total = pathlib.Path(output).stat().st_size
    inside = [deck] * bool(deck) + [f"{plain(name)} ({size(len(content))})" for name, content in files.items()]
    said = f"{output}: {size(total)}" + f", with {', '.join(inside)} in it" * bool(inside)
    holds = {name: len(content) for name, content in files.items()}
    return Answer(said, {"files": [output], "bytes": total, "page": page, "holds": holds})


def _open(address: str) -> bool:
    try:
        return webbrowser.open(address)
    except webbrowser.Error:
        return False
