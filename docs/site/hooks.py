"""What mkdocs.yml cannot say: where the public names of milltools live, that links show titles, not names of files, and
that the first page holds the studio."""

import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
import milltools


def titled(folder: pathlib.Path):
    """[deck.md](deck.md#keys) becomes [The deck](deck.md#keys)."""

    def link(match):
        page = folder / match[2].partition("#")[0]
        first = page.read_text("utf-8").partition("\n")[0] if page.is_file() else ""
        return f"[{first[2:]}]({match[2]})" if first.startswith("# ") else match[0]

    return link


def located(match):
    """`::: milltools.run` becomes the name's own module, under a heading that users know."""
    name = match[1]
    api = milltools._HOMES.get(name)  # not imported: it may need packages that the site does not
    home = f"milltools.api.{api}" if api else getattr(milltools, name).__module__
    return f"::: {home}.{name}\n    options:\n      heading: milltools.{name}\n      toc_label: {name}"


# it is loaded when the reader opens it: a simulation keeps a core busy
STUDIO = """
<details class="studio"><summary>Simulate a mill in this page: the studio</summary>
<iframe src="studio.html" loading="lazy" title="The studio: a ball mill, simulated in this page"></iframe>
<p><a href="studio.html">The studio on a page of its own</a></p></details>
"""


def on_page_markdown(markdown, page, **_):
    if page.is_homepage:  # below its first picture
        markdown = re.sub(r"^!\[.*\)$", lambda picture: picture[0] + "\n" + STUDIO, markdown, count=1, flags=re.MULTILINE)
    markdown = re.sub(r"^::: milltools\.(\w+)$", located, markdown, flags=re.MULTILINE)
    folder = pathlib.Path(page.file.abs_src_path).parent
    return re.sub(r"\[([\w./-]+\.md)\]\(([^)]*)\)", titled(folder), markdown)
