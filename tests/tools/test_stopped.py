"""mill report and mill export, ended by a signal, leave nothing behind."""

import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import PROGRAM, ROOT, SMALL

MILL = (sys.executable, "-m", "milltools")


def seen(process, folder, pattern):
    """Waits until a file is there."""
    for _ in range(900):
        if list(folder.glob(pattern)):
            return
        assert process.poll() is None, "it has ended before"
        time.sleep(0.02)
    raise AssertionError(f"no {pattern}")


@pytest.mark.slow
@pytest.mark.parametrize("number, status", [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_report_takes_the_deck_run_again_with_it(millsim, write_deck, tmp_path, number, status):
    write_deck(SMALL.replace("count = 20", "count = 200"))
    assert millsim("deck.ini", "-q", "-s", "run.time=1 s", "-s", "output.frames=0.1 s").returncode == 0  # fmt: skip
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    environment = {"PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM), "TMPDIR": str(scratch)}  # fmt: skip
    process = subprocess.Popen(
        [*MILL, "report", "deck.h5", "--rerun", "always"],
        cwd=tmp_path, env=os.environ | environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        seen(process, scratch, "mill-*/deck.ini")
        process.send_signal(number)
        said = process.communicate(timeout=30)[1]
    finally:
        process.kill()
    assert (process.returncode, said.splitlines()[-1]) == (status, "mill report: stopped")
    assert list(scratch.iterdir()) == []
    assert not list(tmp_path.glob("*.html*"))


def test_a_stopped_export_leaves_no_half_file(monkeypatch, capsys, millsim, write_deck, tmp_path):
    from milltools.__main__ import main
    from milltools.export import vtp

    write_deck(SMALL)
    assert millsim("deck.ini", "-q").returncode == 0
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["mill", "export", "deck.h5", "balls.vtp"])

    def killed(run, index, at, kept, path):
        path.touch()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(5)

    monkeypatch.setattr(vtp, "write_balls", killed)
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)  # not this process
    try:
        assert main() == 143
    finally:
        signal.signal(signal.SIGTERM, before)
    assert capsys.readouterr().err == "mill export: stopped\n"
    assert not list(tmp_path.glob("balls*"))
