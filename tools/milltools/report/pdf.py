"""A page as PDF: a browser of the Chromium family prints it, without a window and without a network."""

import os
import pathlib
import shutil
import subprocess
import tempfile

from milltools.base.errors import UserError
from milltools.base.extras import on_debian
from milltools.base.files import whole
from milltools.base.processes import guard

SUFFIX = ".pdf"
BROWSERS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge",
)  # fmt: skip
PATIENCE = 300  # [s]


def browser() -> str:
    """The path of the browser; a UserError if there is none."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if not found:
        raise UserError(f"a PDF needs Chromium or Chrome; {on_debian('chromium')}", status=1)
    return found


def write(path, page: str):
    """Prints a page, given as HTML, to a file: whole or not at all."""
    beside = pathlib.Path(path).parent  # the Chromium of a snap cannot read /tmp
    with whole(path) as draft, tempfile.TemporaryDirectory("-report", dir=beside, ignore_cleanup_errors=True) as folder:
        place = pathlib.Path(folder).resolve()
        (place / "page.html").write_text(page, encoding="utf-8", errors="replace")
        words = ["--headless", "--no-pdf-header-footer", "--disable-gpu", "--disable-background-networking"]
        words += ["--no-sandbox"] * (hasattr(os, "geteuid") and os.geteuid() == 0)  # else it refuses to run as root
        words += [f"--user-data-dir={place / 'profile'}", f"--print-to-pdf={place / 'page.pdf'}"]
        command = [*guard(), browser(), *words, (place / "page.html").as_uri()]
        try:
            said = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=PATIENCE).stderr
        except subprocess.TimeoutExpired:
            said = f"no answer in {PATIENCE} s"
        if not (place / "page.pdf").exists():
            last = next(iter(said.strip().splitlines()[-1:]), "no reason given")
            raise UserError(f"{path}: {command[len(guard())]} did not print the page: {last}", status=1)
        shutil.copyfile(place / "page.pdf", draft)
