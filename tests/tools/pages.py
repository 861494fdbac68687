"""Code blocks of the documentation's pages."""

import pathlib
import re

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.M | re.S)


def blocks(path, language) -> list[str]:
    """The fenced blocks of a language in a page, in their order."""
    text = pathlib.Path(path).read_text(encoding="utf-8")
    return [code for named, code in FENCE.findall(text) if named == language]
