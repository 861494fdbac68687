"""The page's Content-Security-Policy: nothing is loaded from anywhere, and only the scripts that we wrote run.

Scripts are allowed by their hash, taken of the fragments before anything from a run is set into the page: were something of a
deck ever to come through unescaped, it would still not be executed."""

import base64
import hashlib
import html.parser

EXECUTED = {"", "module", "text/javascript", "application/javascript", "importmap"}


class _Scripts(html.parser.HTMLParser):
    def __init__(self):
        super().__init__(convert_charrefs=False)
        self.found, self.inside = [], None

    def handle_starttag(self, tag, attributes):
        if tag == "script" and (dict(attributes).get("type") or "").lower() in EXECUTED:
            self.inside = []

    def handle_data(self, data):
        if self.inside is not None:
            self.inside.append(data)

    def handle_endtag(self, tag):
        if tag == "script" and self.inside is not None:
            self.found.append("".join(self.inside))
            self.inside = None


def scripts(*fragments: str) -> list[str]:
    """The texts of all scripts in pieces of HTML that a browser would run."""
    reader = _Scripts()
    for fragment in fragments:
        reader.feed(fragment)
    return reader.found


def of(*fragments: str) -> str:
    """The policy of a page whose scripts are those of the fragments."""
    hashes = [
        "'sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() + "'"
        for text in dict.fromkeys(scripts(*fragments))
    ]
    run = " ".join(hashes) or "'none'"
    return (
        f"default-src 'none'; script-src {run}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )
