"""The page of `mill watch`."""

import base64
import hashlib
import json
import pathlib

FOLDER = pathlib.Path(__file__).parent


def scripts(place: str) -> list[str]:
    """The scripts that make a page watch the run whose data are below the path `place`."""
    return [f"window.MILL_WATCH = {json.dumps(place)};", (FOLDER / "source.js").read_text("utf-8")]


def text(place: str) -> str:
    show = """const source = new WatchSource(window.MILL_WATCH); window.heard = [];
source.on = (m) => { window.heard.push(m); if (m.type === 'progress') document.body.textContent = m.note; };"""
    own = [*scripts(place), show]
    hashes = " ".join(f"'sha256-{base64.b64encode(hashlib.sha256(one.encode()).digest()).decode()}'" for one in own)
    policy = f"default-src 'none'; script-src {hashes}; connect-src 'self'; base-uri 'none'; form-action 'none'"
    body = "".join(f"<script>{one}</script>" for one in own)
    return f'<!doctype html><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{policy}"><title>mill watch</title><body>{body}'
