"""Reports for the tests of them, made once a session: `pytest_plugins = ["browser", "reported"]` in a test module."""

import re
import subprocess

import pytest
from conftest import PROGRAM, SMALL
from report_page import Reader, report

from milltools.base.text import size


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """A folder with small.h5, the run of the small mill, and two of it that ended before anything was sampled:
    frames.h5, which has the balls, and nothing.h5, which has not. Reports of these take little time."""
    made = tmp_path_factory.mktemp("report")
    (made / "small.ini").write_text(SMALL)
    for name, sets in {
        "small": ["run.time=0.4 s"],
        "frames": [
            "run.time=0.2 s",
            "run.sample_from=0.19 s",
            "run.max_collisions=40",
            "output.series=1 s",
        ],
        "nothing": [
            "run.time=0.2 s",
            "run.sample_from=0.19 s",
            "run.max_collisions=40",
            "output.series=1 s",
            "output.frames=0 s",
        ],
    }.items():
        words = [word for option in sets for word in ("-s", option)]
        subprocess.run(
            [PROGRAM, "-q", "small.ini", "-o", f"{name}.h5", *words], cwd=made, check=True, capture_output=True
        )
    return made


@pytest.fixture(scope="session")
def page(folder):
    """The report of the small mill: path, text, Reader."""
    done = report(folder, "small.h5")
    assert done.returncode == 0, done.stderr
    assert all(re.match(r"mill report: .*(\d %| s left)$", line) for line in done.stderr.splitlines()), done.stderr
    path = folder / "small.html"
    assert done.stdout == f"small.html: {size(path.stat().st_size)}\n"
    text = path.read_text("utf-8")
    return path, text, Reader(text)


@pytest.fixture(scope="session")
def nothing(folder):
    """The report of the run in which nothing was sampled: text, Reader."""
    done = report(folder, "nothing.h5")
    assert done.returncode == 0, done.stderr
    text = (folder / "nothing.html").read_text("utf-8")
    return text, Reader(text)


@pytest.fixture(scope="session")
def compared(folder):
    """The page of two runs of the small mill: path, Reader."""
    for seed in (1, 2):
        words = ["-s", f"run.seed={seed}", "-s", "run.time=0.8 s", "-s", "output.frames=20 ms"]
        subprocess.run(
            [PROGRAM, "-q", "small.ini", "-o", f"seed{seed}.h5", *words], cwd=folder, check=True, capture_output=True
        )
    done = report(folder, "--compare", "seed1.h5", "seed2.h5")
    assert done.returncode == 0, done.stderr
    path = folder / "seed1-compared.html"
    assert done.stdout == f"seed1-compared.html: {size(path.stat().st_size)}\n"
    return path, Reader(path.read_text("utf-8"))
