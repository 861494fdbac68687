"""`mill studio`: a page in which a ball mill turns, simulated by the engine in the browser.

`make studio` builds the page (build.py); an installed package brings it.
"""

import base64
import json
import pathlib
import webbrowser
import zlib

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable, write_text
from milltools.base.text import size
from milltools.read import deck_text

SUMMARY = (
    "Opens a page in the browser in which a ball mill turns: simulated live, with sliders for the design, the power "
    "and its error, the energies of the impacts and the energy balance. The page is one file that needs no network."
)
OWN = '<script type="application/json" id="own">null</script>'  # in the page: the deck to begin with
LONGEST = 30_000  # characters of a link; browsers cut longer ones


def add_arguments(parser):
    parser.add_argument("deck", nargs="?", metavar="DECK", help="the mill to begin with; default: the reference mill")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="write the page, with DECK and the files that it names, instead of opening it",
    )


def run(arguments) -> Answer:
    page = built()
    text = deck_text.read_text(arguments.deck) if arguments.deck else None
    files = named(arguments.deck, text) if text else []
    if arguments.output:
        return _write(page, arguments.output, arguments.deck, text, files)
    if files:
        raise UserError(f"{arguments.deck}: needs {files[0].name}: write a page that has both with -o FILE.html")
    address = page.as_uri() + (f"#design={packed(text)}" if text else "")
    if len(address) > LONGEST:
        raise UserError(f"{arguments.deck}: is too long for a link: write a page that has it with -o FILE.html")
    opened = _open(address)
    return Answer(f"{page}: opened in the browser" if opened else address, {"files": [], "page": page, "link": address})


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


def named(path: str, text: str) -> list[pathlib.Path]:
    """The files in the folder of the deck that its values name, such as meshes."""
    folder = pathlib.Path(path).parent
    values = {one.value for one in deck_text.entries(text, path) if one.value and len(one.value) < 200}
    inside = [value for value in sorted(values) if not {"..", "/"} & set(pathlib.Path(value).parts)]
    return [folder / value for value in inside if (folder / value).is_file()]


def _write(page, output, deck, text, files) -> Answer:
    sources = [page, *([deck] if deck else []), *files]
    if pathlib.Path(output).exists():
        raise UserError(f"{output}: exists; give another name, or remove it")
    check_writable(output, sources)
    whole = page.read_text("utf-8")
    if text:
        held = {path.relative_to(pathlib.Path(deck).parent).as_posix(): _text(path) for path in files}
        own = json.dumps({"text": text, "files": held}).replace("<", "\\u003c")
        whole = whole.replace(OWN, OWN.replace("null", own, 1), 1)
    write_text(output, whole)
    total = pathlib.Path(output).stat().st_size
    return Answer(f"{output}: {size(total)}", {"files": [output], "bytes": total, "page": page})


def _text(path) -> str:
    return base64.b64encode(path.read_bytes()).decode()


def _open(address: str) -> bool:
    try:
        return webbrowser.open(address)
    except webbrowser.Error:
        return False
