"""However `mill dem` ends, results are kept, nothing runs on, nothing lies about; and what is seen of it on the way."""

import os
import pathlib
import pty
import re
import signal
import subprocess
import sys
import tempfile
import time

import pytest
from conftest import PROGRAM, ROOT, SMALL, SMALL_START, some

import milltools.base.progress
import milltools.dem.command
from milltools.__main__ import main
from milltools.dem.soft_mill import SoftMill
from milltools.read.runfile import Run

MARK = "MILL_DEM_TEST"  # in the environment of all that a test starts


def living(mark):
    """{pid: command line} of LIGGGHTS, mpirun and the like that descend from a process started with this mark."""
    found = {}
    for folder in pathlib.Path("/proc").iterdir():
        try:
            if f"{MARK}={mark}".encode() in (folder / "environ").read_bytes().split(b"\0"):
                words = (folder / "cmdline").read_bytes().split(b"\0")
                if words[0] and b"python" not in words[0]:
                    found[int(folder.name)] = words[:3]
        except (OSError, ValueError):
            continue
    return found


def heed_signals():
    """Tests that run in the background of a shell, or under nohup, hand on that signals are ignored."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@pytest.fixture
def start(tmp_path, write_deck):
    """start(*words) starts `mill dem` on a mill that runs for minutes, waits until it has begun, and returns the
    process. Whatever a test does, none of it lives on after it."""
    write_deck(SMALL.replace("friction = 0.3", "friction = 0.3\ntangential_restitution = 0.484"))
    (tmp_path / "scratch").mkdir()
    mark, started = str(tmp_path), []

    def run(*words, begun="torque.txt", at_once=("-m", "milltools"), **options):
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM)}
        environment.update({MARK: mark, "TMPDIR": str(tmp_path / "scratch")})
        words = [sys.executable, *at_once, "dem", "deck.ini", "--modulus", "1e9", "--time", "100 s", *words]
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "stdin": subprocess.DEVNULL, **options}
        process = subprocess.Popen(
            words, cwd=tmp_path, env=environment, start_new_session=True, preexec_fn=heed_signals, **options
        )
        started.append(process)
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and process.poll() is None:
            screens = (tmp_path / "scratch").glob(f"mill-dem-*/{begun}")
            if any(path.read_text().count("\n") > (40 if begun == "torque.txt" else 0) for path in screens):
                break
            time.sleep(0.02)
        process.mark = mark
        return process

    yield run
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
    for pid in living(mark):
        os.kill(pid, signal.SIGKILL)


INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.mark.slow
@pytest.mark.parametrize("number, ranks", some([(INT, 1), (TERM, 1), (HUP, 1), (TERM, 2), (INT, 2), (HUP, 2)], 3))
def test_a_signal_ends_it_with_its_results_and_leaves_nothing(start, tmp_path, number, ranks):
    process = start("--quiet", "--ranks", str(ranks))
    assert process.poll() is None and living(process.mark)
    shared = set(os.listdir("/dev/shm"))
    os.killpg(process.pid, number)  # as a terminal does: the whole group
    out, err = (text.decode() for text in process.communicate(timeout=30))
    assert process.returncode == 128 + number, err
    assert living(process.mark) == {}
    assert list((tmp_path / "scratch").iterdir()) == []
    assert set(os.listdir("/dev/shm")) <= shared
    assert re.fullmatch(
        rf"mill dem: stopped by {number.name} at \S+ ms; results up to then are in deck-dem.h5\n",
        err,
    )
    assert "\ncost " in out and "Traceback" not in out
    with Run(tmp_path / "deck-dem.h5") as run:
        assert run.status == "stopped"
        rows = run.series("kinetic_energy")[0]
        assert len(rows) > 3 and rows[-1] <= run.time < 100
        assert run.duration == pytest.approx(run.time)
        assert run.read("run/cpu_time") > 0


@pytest.mark.slow
@pytest.mark.parametrize("ranks", some([1, 2], 2))
def test_kill_9_takes_liggghts_with_it_and_leaves_little(start, tmp_path, ranks):
    process = start("--quiet", "--ranks", str(ranks))
    assert living(process.mark)
    shared = set(os.listdir("/dev/shm"))
    process.kill()
    process.wait()
    deadline = time.monotonic() + 10
    while living(process.mark) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert living(process.mark) == {}
    assert sum(p.stat().st_size for p in (tmp_path / "scratch").rglob("*") if p.is_file()) < 20e6
    assert set(os.listdir("/dev/shm")) <= shared
    with Run(tmp_path / "deck-dem.h5") as run:  # as far as it was told: nothing is lost but the last row
        assert run.status == "failed" and run.duration == run.time > 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["deck-dem.h5", "deck.ini", "scratch"]


@pytest.mark.slow
def test_a_signal_among_the_single_impacts_is_no_traceback(start, tmp_path):
    """Before the first row: there are no results, and the file says so."""
    process = start("--quiet", begun="in.txt")
    process.send_signal(signal.SIGTERM)
    out, err = (text.decode() for text in process.communicate(timeout=30))
    assert (process.returncode, err.count("\n")) == (143, 1)
    assert list((tmp_path / "scratch").iterdir()) == []
    with Run(tmp_path / "deck-dem.h5") as run:
        assert (run.status, run.time, run.duration) == ("stopped", 0, 0)


# ---- in this process: what is seen on the way ----


@pytest.fixture
def dem(tmp_path, monkeypatch, capsys, write_deck):
    """dem(*words) runs the small mill for 6 ms, without single impacts and price: (status, out, err)."""
    (tmp_path / "scratch").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "scratch"))
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(milltools.dem.command.Job, "check_singles", lambda job: None)
    monkeypatch.setattr(SoftMill, "price", lambda *_: float("nan"))
    write_deck(SMALL.replace("friction = 0.3", "friction = 0"))

    def run(*words):
        line = ["mill", "dem", "deck.ini", "--modulus", "1e8", "--time", "6 ms", *words]
        monkeypatch.setattr(sys, "argv", line)
        return main(), *capsys.readouterr()

    return run


@pytest.mark.slow
def test_the_file_can_be_read_while_the_run_goes_on(dem, monkeypatch, tmp_path):
    seen, publish, path = [], milltools.dem.command.Job.publish, tmp_path / "deck-dem.h5"

    def look(job, mill):
        before = path.stat().st_ino if path.exists() else 0
        publish(job, mill)
        deadline = time.monotonic() + 20
        while (path.stat().st_ino if path.exists() else 0) == before and time.monotonic() < deadline:
            time.sleep(0.001)
        with Run(path) as run:
            seen.append((run.status, run.time, len(run.series("kinetic_energy")[0]), run.duration))
        job.published = time.monotonic()  # looking takes longer than PUBLISH

    monkeypatch.setattr(milltools.dem.command, "PUBLISH", 0.01)
    monkeypatch.setattr(milltools.dem.command.Job, "publish", look)
    assert dem("--quiet", "--modulus", "1e9", "--time", "40 ms")[0] == 0
    assert len(seen) > 2 and {status for status, *_ in seen} == {"running"}
    times = [reached for _, reached, *_ in seen]
    assert times == sorted(times)
    for _, reached, rows, duration in seen:
        assert rows == round(reached * 1e3) + 1 and duration == reached
    with Run(path) as run:
        assert (run.status, run.time, run.duration) == ("complete", 0.04, 0.04)


@pytest.mark.slow
def test_progress_is_plain_lines_where_there_is_no_terminal(dem, monkeypatch):
    monkeypatch.setattr(milltools.base.progress, "PLAIN", 0.001)
    monkeypatch.setattr(milltools.base.progress, "PATIENCE", 0.0)
    status, _, err = dem()
    lines = err.splitlines()
    assert status == 0 and len(lines) > 1
    form = r"mill dem: LIGGGHTS at (\d\.\d\d) of 6 ms, (\d+) %(, [\d.]+ (s|min|h) left)?"
    told = [tuple(map(float, re.fullmatch(form, line).groups()[:2])) for line in lines]
    assert told == sorted(told)
    for reached, share in told:
        assert share == pytest.approx(100 * reached / 6, abs=1)


@pytest.mark.slow
def test_quiet_says_nothing_on_the_way(dem, monkeypatch):
    monkeypatch.setattr(milltools.base.progress, "PLAIN", 0.0)
    monkeypatch.setattr(milltools.base.progress, "PATIENCE", 0.0)
    assert dem("--quiet")[2] == ""


AT_ONCE = """\
import sys
from milltools.base import progress
progress.PATIENCE = progress.SHORT = 0.0
from milltools.__main__ import main
sys.exit(main())
"""  # mill, but a bar is shown from the beginning


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["stopped", "done"])
def test_on_a_terminal_a_bar_moves_and_the_cursor_comes_back(start, tmp_path, ending):
    try:
        master, terminal = pty.openpty()
    except OSError as fault:
        pytest.skip(f"no terminal to be had here: {fault}")
    words = ["--time", "100 s" if ending == "stopped" else "40 ms"]
    process = start(*words, stderr=terminal, stdout=subprocess.DEVNULL, at_once=("-c", AT_ONCE))
    os.close(terminal)
    seen = b""
    while True:
        try:
            some = os.read(master, 65536)
        except OSError:  # Linux: the other end is closed
            break
        if not some:
            break
        seen += some
        if ending == "stopped" and b"left" in seen:
            process.send_signal(signal.SIGINT)
            ending = "ends"
    os.close(master)
    assert process.wait(timeout=30) == (130 if ending == "ends" else 0)
    text = seen.decode()
    shown = re.findall(r"LIGGGHTS at (\d+\.\d\d) of (?:100000|40|1e\+05) ms", text)
    assert len(set(shown)) > 1
    assert re.search(r"\d+ (s|min|h) left|\d\.\d h left", text)
    assert text.rfind("\x1b[?25h") > text.rfind("\x1b[?25l") > -1
    assert "Traceback" not in text


def test_a_start_that_is_refused_leaves_the_terminal_alone(dem, monkeypatch, tmp_path):
    (tmp_path / "start.txt").write_text(SMALL_START.replace("0.016 0.027", "0.012 0.027"))
    stopped = []
    monkeypatch.setattr(milltools.dem.command, "Progress", lambda *_: stopped.append("a bar was begun"))
    status, out, err = dem("--set", "balls.start=start.txt")
    assert (status, out, err.count("\n"), stopped) == (2, "", 1, [])
    assert "overlap" in err


# ---- full disks ----


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 128 KiB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=128k", "none", str(place)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("mounting wants root")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_full_disk_is_one_line_and_leaves_no_half_file(dem, small_disk, tmp_path):
    (small_disk / "filled").write_bytes(bytes(100_000))
    status, out, err = dem("--quiet", "--output", f"{small_disk}/out.h5")
    assert (status, out) == (1, "")
    assert re.fullmatch(r"mill dem: \S+/disk/out.h5: cannot write .*: No space left on device\n", err)
    assert [path.name for path in small_disk.iterdir()] == ["filled"]
    assert list((tmp_path / "scratch").iterdir()) == []


def test_a_full_disk_for_temporary_files_is_one_line(dem, small_disk, monkeypatch):
    """There is no room for what LIGGGHTS reads."""
    monkeypatch.setattr(tempfile, "tempdir", str(small_disk))
    (small_disk / "filled").write_bytes(bytes(131_072 - 4096))
    status, out, err = dem("--quiet", "--set", "balls.count=200")
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("mill dem: ") and "No space left on device" in err
    assert [path.name for path in small_disk.iterdir()] == ["filled"]
