"""Assembles the page of the studio, one file that needs no network:
`python -m milltools.studio.build WASM OUT NOTICE...`.

WASM is the engine as a WebAssembly module (src/web; `make studio` builds both); a NOTICE is a file with the licence of
a library in it. The page has everything inside: style, scripts, three.js, the decks to begin with, and the engine,
compressed with gzip, in base64.
"""

import base64
import gzip
import pathlib
import sys

from milltools import pages
from milltools.base.engine import ROOT
from milltools.base.errors import UserError
from milltools.base.files import write_text
from milltools.player import player

FOLDER = pathlib.Path(__file__).parent
# decks of input/ to begin with, in the order of the keys 1 to 6
PRESETS = {
    "simoloyer": "reference mill",
    "wavy": "wavy drum",
    "planetary": "planetary jar",
    "mixer": "mixer mill",
    "attritor": "attritor",
    "tumbling": "tumbling mill",
}
# in the order in which they are loaded
SCRIPTS = [
    f"{name}.js"
    for name in ("words", "deck", "results", "charts", "controls", "painter", "stage", "panel", "show", "studio")
]
MOST = 4_000_000  # bytes of a page that can be mailed
SLOWEST = (1, 2, 5, 10, 20, 50, 100, 1000)  # times slower than real time
SPEEDS = [("auto", "fast, then slow motion"), ("fast", "as fast as possible")] + [
    (1 / n, f"1/{n} of real time" if n > 1 else "real time") for n in SLOWEST
]
KEYS = (
    ("space", "play or pause"),
    (", .", "the state before; the next state"),
    ("← ↑ → ↓", "turn the view"),
    ("+ −", "zoom"),
    ("Home", "the first view"),
    ("1 … 6", "another mill: reference, wavy, planetary, mixer, attritor, tumbling"),
    ("?", "this list"),
)


def presets() -> list[dict]:
    """The decks that the page has: [{name, title, text}]."""
    texts = {name: (ROOT / "input" / f"{name}.ini").read_text("utf-8") for name in PRESETS}
    return [{"name": name, "title": title, "text": texts[name]} for name, title in PRESETS.items()]


def page(source: dict[str, str], start: str, scripts=(), decks=(), title="A ball mill: the run", notices="") -> str:
    """The page. `source`: {id: text} of data for the source of states, such as the engine; `scripts`: texts that define
    it; `start`: the expression that makes it; `decks`: those to begin with, as of presets(); `notices`: licences."""
    paths = [player.FOLDER / "vendor/three.min.js", player.FOLDER / "mill3d.js", *(FOLDER / name for name in SCRIPTS)]
    texts = [pages.FOLDER.joinpath("theme.js").read_text("utf-8"), *(path.read_text("utf-8") for path in paths)]
    texts += [*scripts, f"MillStudio.start(async (data) => {start});"]
    return (
        pages.environment(FOLDER)
        .get_template("page.html")
        .render(
            title=title,
            policy=pages.policy(texts, more="'wasm-unsafe-eval'") + "; worker-src blob:; connect-src 'self'",
            maker=pages.maker(),
            style=pages.style(pages.FOLDER / "report.css", player.FOLDER / "player.css", FOLDER / "studio.css"),
            speeds=SPEEDS,
            keys=KEYS,
            data=source.items(),
            presets=list(decks),
            notices=notices,
            scripts=texts,
        )
    )


def palette() -> str:
    """The colours of speeds, 256 times red, green, blue, in base64."""
    from milltools.render import colour

    return base64.b64encode(colour.TABLES["speeds"].tobytes()).decode()


def packed(data: bytes) -> str:
    """Bytes as base64 text of a gzip stream."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


def main(wasm: str, out: str, *notices: str) -> None:
    worker = "\n".join((FOLDER / name).read_text("utf-8") for name in ("engine.js", "worker.js"))
    data = {"engine": packed(pathlib.Path(wasm).read_bytes()), "worker": worker, "colours": palette()}
    start = "new EngineSource(data.text('worker'), await data.unpacked('engine'), data.bytes('colours'))"
    scripts = [(FOLDER / "source.js").read_text("utf-8")]
    licences = "\n\n".join(pathlib.Path(path).read_text("utf-8") for path in (ROOT / "LICENSE", *notices))
    text = page(data, start, scripts, presets(), "A ball mill, simulated in this page", licences)
    if len(text.encode()) > MOST:
        raise UserError(f"{out}: would have {len(text.encode())} bytes, more than {MOST}", status=1)
    write_text(out, text)


if __name__ == "__main__":
    main(*sys.argv[1:])
