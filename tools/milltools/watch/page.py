"""The page of `mill watch`: that of the studio, with a source that asks the server instead of the engine."""

import json
import pathlib

SOURCE = pathlib.Path(__file__).parent / "source.js"


def scripts(place: str) -> list[str]:
    """The scripts that make a source of the run whose data are below the path `place`, window.MILL_WATCH."""
    return [f"window.MILL_WATCH = {json.dumps(place)};", SOURCE.read_text("utf-8")]


def text(place: str) -> str:
    from milltools.studio import build

    return build.page({}, "new WatchSource(window.MILL_WATCH)", scripts(place))
