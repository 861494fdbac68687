"""Reports for the tests of them, made once a session: `pytest_plugins = ["browser", "reported"]` in a test module."""

import contextlib
import io
import re
import shutil
import subprocess

import h5py
import pytest
from conftest import PROGRAM, SMALL, once, run_mill
from PIL import Image
from report_page import Reader, report

from milltools.base import processes
from milltools.base.progress import Progress
from milltools.base.text import size
from milltools.compare import load, pictures, rows
from milltools.compare import page as compare_page
from milltools.player import parts
from milltools.read.runfile import Run
from milltools.report import run_page

SHORT = ["run.time=0.2 s", "run.sample_from=0.19 s", "run.max_collisions=40", "output.series=1 s"]
RUNS = {
    "small": ["run.time=0.4 s"],
    "frames": SHORT,
    "nothing": [*SHORT, "output.frames=0 s"],
    # not steady, so errors come from replicates; frames so close that states between them are drawn
    **{
        f"{name}{seed}": [
            f"rotor.speed={rpm} rpm",
            "run.time=0.14 s",
            f"run.seed={seed}",
            "output.frames=0.5 ms",
            "output.impacts=all",
        ]
        for name, rpm in (("quick", 1000), ("slow", 800))
        for seed in (1, 2)
    },
}
HOSTILE = "<img src=x onerror=alert(1)> $_{x^ \x1b[31m.h5"


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A folder with RUNS: small.h5, the run of the small mill, and two of it that ended before anything was sampled:
    frames.h5, which has the balls, and nothing.h5, which has not. Reports of these take little time."""

    def make(folder):
        (folder / "small.ini").write_text(SMALL)
        for name, sets in RUNS.items():
            words = [word for option in sets for word in ("-s", option)]
            command = [PROGRAM, "-q", "small.ini", "-o", f"{name}.h5", *words]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)

    return once(tmp_path_factory, "report", make)


def made(factory, folder, page, *words):
    """(path, text, Reader) of a page that `mill report WORDS` makes in the folder."""

    def make(_):
        done = report(folder, *words)
        assert done.returncode == 0, done.stderr
        assert all(re.match(r"mill report: .*(\d %| s left)$", line) for line in done.stderr.splitlines()), done.stderr
        assert done.stdout == f"{page}: {size((folder / page).stat().st_size)}\n"

    once(factory, page, make)
    text = (folder / page).read_text("utf-8")
    return folder / page, text, Reader(text)


@pytest.fixture(scope="session")
def page(tmp_path_factory, folder):
    """The report of the small mill: path, text, Reader."""
    return made(tmp_path_factory, folder, "small.html", "small.h5")


@pytest.fixture(scope="session")
def nothing(tmp_path_factory, folder):
    """The report of the run in which nothing was sampled: text, Reader."""
    return made(tmp_path_factory, folder, "nothing.html", "nothing.h5")[1:]


@pytest.fixture(scope="session")
def compared(tmp_path_factory, folder):
    """The page of `mill compare` of the small mill at two speeds, of which one has hostile names: path, text, Reader,
    what the terminal shows. Its table is table.csv."""

    def make(place):
        shutil.copy(folder / "quick1.h5", place / HOSTILE)
        with h5py.File(place / HOSTILE, "r+") as file:
            del file["deck/balls/start"], file["run/command"]
            file["deck/balls/start"], file["run/command"] = "<script>alert(2)</script>\x1b[2J", "</code><b>"
        sides = f"{HOSTILE},{folder}/quick2.h5", f"{folder}/slow1.h5,{folder}/slow2.h5"
        done = run_mill(place, "compare", *sides, "--html", "page.html", "--csv", "table.csv", "--rerun", "never")
        assert done.returncode == 0, done.stderr
        (place / "said").write_text(done.stdout)

    place = once(tmp_path_factory, "compared", make)
    text = (place / "page.html").read_text("utf-8")
    return place / "page.html", text, Reader(text), (place / "said").read_text()


@pytest.fixture
def undrawn(monkeypatch):
    """undrawn(*paths, rerun) is (text, Reader) of the report of a run, or of the comparison of several, without figures
    and pictures: they take most of its time."""
    monkeypatch.setattr(parts, "draw", lambda name, runs: parts.Picture(name, "", "", "", "left out"))
    Image.new("RGB", (1, 1)).save(pixel := io.BytesIO(), format="png")
    monkeypatch.setattr(parts, "still", lambda *_: pixel.getvalue())
    monkeypatch.setattr(processes, "cores", lambda: 1)
    monkeypatch.setattr(pictures, "PICTURES", ())

    def make(*paths, rerun="never"):
        with contextlib.redirect_stderr(io.StringIO()), Progress("mill report", 100) as watch:
            if len(paths) > 1:
                sides = load.sides([[str(path)] for path in paths])
                text = compare_page.render(sides, rows.tables(sides), watch, rerun)
            else:
                with Run(paths[0]) as run:
                    text = run_page.render(run, watch, rerun)
        return text, Reader(text)

    return make
