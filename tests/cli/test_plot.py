"""tools/plot_run.py draws every run there can be."""

import subprocess
import sys

import pytest
from conftest import ROOT, SMALL


def plot(folder, run):
    return subprocess.run(
        [sys.executable, ROOT / "tools/plot_run.py", run, "run.png"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
    )


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["contact.restitution=1", "contact.friction=0", "contact.rebound_floor=0 m/s"],
        ["output.frames=0 s"],
        ["run.sample_from=49.9 ms"],
        ["rotor.speed=-600 rpm", "blades.pitch=30 deg"],
    ],
)
def test_a_run_becomes_a_picture(millsim, write_deck, tmp_path, options):
    write_deck(SMALL)
    sets = [word for option in options for word in ("-s", option)]
    assert millsim("deck.ini", "-q", *sets).returncode == 0
    done = plot(tmp_path, "deck.h5")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


def test_a_file_that_is_no_run_is_one_line(tmp_path):
    (tmp_path / "foreign.h5").write_text("no HDF5")
    for name in ("foreign.h5", "missing.h5"):
        done = plot(tmp_path, name)
        assert done.returncode == 1
        assert done.stderr.startswith(f"plot_run.py: {name}: ")
        assert len(done.stderr.splitlines()) == 1
