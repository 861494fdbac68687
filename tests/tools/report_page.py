"""What the tests of reports read their pages with, and how they are made."""

import html.parser
import resource

from conftest import run_mill


class Reader(html.parser.HTMLParser):
    """What a page holds: `tags` with their attributes, `text` without that of scripts and styles, `data` of <data>."""

    VOID = {"meta", "img", "input", "br", "link"}

    def __init__(self, page):
        super().__init__()
        self.tags, self.data, self.rows, self.open, self.pieces, self.head = [], [], {}, [], [], None
        self.feed(page)
        self.text = " ".join(" ".join(self.pieces).split())

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "tr":
            self.head = None
        if tag == "data":
            self.data.append(float(dict(attributes)["value"]))
            if self.head:
                self.rows.setdefault(self.head, []).append(self.data[-1])

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> at {self.getpos()}"
        if tag == "tr":
            self.head = None

    def handle_data(self, text):
        if not {"script", "style"} & set(self.open):
            self.pieces.append(text)
            if self.open[-1:] == ["th"] and "tr" in self.open:
                self.head = text

    def ids(self, tag):
        return [a["id"] for t, a in self.tags if t == tag and "id" in a]


def report(folder, *words, timeout=300, room=None):
    """`mill report` in a folder; room [bytes]: no file may be larger, as on a disk that is full."""
    limit = room and (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)))
    return run_mill(folder, "report", *words, timeout=timeout, preexec_fn=limit)
