"""The watch over LIGGGHTS: each way in which it fails, most of them with status 0, is one line and leaves nothing
running.

A program in its place, `liggghts` on the PATH, plays them.
"""

import os
import pathlib
import signal
import stat
import sys
import threading
import time

import numpy as np
import pytest

from milltools.base.errors import UserError
from milltools.base.processes import Stopped, at_once, between_steps, stops_in_order
from milltools.dem.liggghts import Liggghts, command, states

BALLS, SAMPLES, TRIANGLES = 7, 5, 24
FAKE = f"""#!{sys.executable}
import os, signal, struct, sys, time
play, balls = os.environ["PLAY"], {BALLS}
screen = open("screen.txt", "w")

def say(text):
    screen.write(text + "\\n")
    screen.flush()

def row(ball, step):
    return [ball + 1.0] + [ball + step + 0.125 * k for k in range(9)]

def dump(step, rows, claimed=None, width=10):
    numbers = [v for row in rows for v in row]
    count = len(rows) if claimed is None else claimed
    head = struct.pack("<qq", step, count) + bytes(76) + struct.pack("<ii", width, 1)
    return head + struct.pack("<i", len(numbers)) + struct.pack(f"<{{len(numbers)}}d", *numbers)

say("LIGGGHTS (Version LIGGGHTS-PLAY 3.8.0, compiled 2026-01-01)")
if play == "dead at once": sys.exit(139)
if play == "segfault": os.kill(os.getpid(), signal.SIGSEGV)
if play == "library": sys.exit("liggghts: error while loading shared libraries: libmpi.so.40")
if play == "never opens": time.sleep(3600)
mesh = 12 if play == "mesh" else {TRIANGLES}
if play != "no mesh": say(f"Import of mesh rotor containing {{mesh}} triangle(s) successful")
if play == "error": say("ERROR: Fix wall/gran (id drum): illegal (./src/fix.cpp:1)"); sys.exit(0)
out = open("state.bin", "wb", buffering=0)
for sample in range({SAMPLES}):
    step, rows = 5 * sample, [row(ball, 5 * sample) for ball in reversed(range(balls))]
    if sample == 3:
        if play == "lost": rows = rows[:-2]
        if play == "early": say("x"); sys.exit(0)
        if play == "half a sample": out.write(dump(step, rows)[:-40]); sys.exit(0)
        if play == "hangs": time.sleep(3600)
        if play == "garbage": out.write(os.urandom(4096))
        if play == "wide": out.write(dump(step, rows, width=11))
        if play == "more": rows = rows + rows[:1]
        if play == "twice": rows[0] = rows[1]
        if play == "no number": rows[2][4] = float("nan")
        if play == "part": out.write(dump(step, rows)[:100] + struct.pack("<i", 1 << 30))
        if play == "empty part": out.write(dump(step, rows)[:100] + struct.pack("<i", 0))
        if play == "negative part": out.write(dump(step, rows)[:100] + struct.pack("<i", -10))
    data = dump(step, rows)
    if play == "slow":
        for first in range(0, len(data), 37): out.write(data[first:first + 37]); time.sleep(0.004)
    else:
        out.write(data)
out.close()
if play == "hangs at the end": time.sleep(3600)
if play == "lost later": balls -= 1
if play == "not over": sys.exit(0)
say(f"Loop time of 0.1 on 1 procs for 20 steps with {{balls}} atoms, finish time now")
say("Neighbor list builds = 4\\nDangerous builds = " + ("3" if play == "dangerous" else "0"))
if play == "late error": say("ERROR on proc 0: Lost atoms (./src/thermo.cpp:1)")
if play == "status": sys.exit(3)
"""


@pytest.fixture
def play(tmp_path, monkeypatch):
    """play(what, inspect) follows the program that plays `what` to its end, as a run does, and returns the samples."""
    program = tmp_path / "bin/liggghts"
    program.parent.mkdir()
    program.write_text(FAKE)
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    started = []

    def run(what, inspect=lambda process: None):
        monkeypatch.setenv("PLAY", what)
        folder = tmp_path / "run"
        folder.mkdir()
        seen = []
        with Liggghts(folder, "", BALLS, TRIANGLES) as process:
            started.append(process)
            for step, rows in process.samples(SAMPLES):
                seen.append((step, np.hstack(states(rows))))
                inspect(process)
            process.finish()
        return seen

    yield run
    for process in started:
        assert process.process.returncode is not None
        assert process._session() == {}


def test_every_sample_arrives_with_the_balls_in_their_order(play):
    seen = play("well")
    assert [step for step, _ in seen] == [0, 5, 10, 15, 20]
    for step, state in seen:
        wanted = np.arange(BALLS)[:, None] + step + 0.125 * np.arange(9)
        assert np.array_equal(state, wanted)


def test_a_slow_writer_is_waited_for(play):
    assert np.array_equal(play("slow")[4][1][:, 0], np.arange(BALLS) + 20.0)


FAILURES = {
    "lost": "LIGGGHTS lost 2 of 7 balls by step 15: ",
    "lost later": "LIGGGHTS ended with 6 of 7 balls",
    "error": "LIGGGHTS failed with status 0: ERROR: Fix wall/gran (id drum): illegal",
    "late error": "LIGGGHTS failed with status 0: ERROR on proc 0: Lost atoms",
    "dead at once": "LIGGGHTS failed with status 139: it said nothing",
    "segfault": "LIGGGHTS was ended by signal 11: it said nothing",
    "library": "LIGGGHTS failed with status 1: liggghts: error while loading shared libraries: libmpi.so.40",
    "status": "LIGGGHTS failed with status 3: it said nothing",
    "mesh": "LIGGGHTS read 12 of the 24 triangles of the meshes",
    "no mesh": "LIGGGHTS read none of the 24 triangles of the meshes",
    "early": "LIGGGHTS ended before its run was over",
    "not over": "LIGGGHTS ended before its run was over",
    "half a sample": "LIGGGHTS ended before its run was over",
    "dangerous": "LIGGGHTS updated its lists of neighbours too late (3 dangerous builds)",
    "garbage": "what LIGGGHTS writes cannot be read: state.bin begins a dump of ",
    "wide": "what LIGGGHTS writes cannot be read: state.bin begins a dump of 7 x 11 numbers in 1 parts",
    "more": "what LIGGGHTS writes cannot be read: state.bin begins a dump of 8 x 10 numbers in 1 parts",
    "twice": "what LIGGGHTS writes cannot be read: a sample has numbers that are not finite, or not every ball ",
    "empty part": "what LIGGGHTS writes cannot be read: state.bin does not name every ball once at step 15",
    "part": "what LIGGGHTS writes cannot be read: state.bin has a part of 1073741824 numbers at step 15",
    "negative part": "what LIGGGHTS writes cannot be read: state.bin has a part of -10 numbers at step 15",
    "no number": "what LIGGGHTS writes cannot be read: a sample has numbers that are not finite, or not every ball ",
}  # fmt: skip


@pytest.mark.parametrize("what", FAILURES)
def test_a_failure_is_one_line_and_status_1(play, what):
    with pytest.raises(UserError) as fault:
        play(what)
    assert str(fault.value).startswith(FAILURES[what])
    assert fault.value.status == 1


def test_a_broken_mesh_is_told_at_the_first_sample_not_after_the_run(play):
    with pytest.raises(UserError, match="read 12 of the 24"):
        play("mesh", inspect=lambda process: pytest.fail("a sample was handed out"))


@pytest.mark.parametrize("what", ["never opens", "hangs", "hangs at the end"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_program_that_hangs(play, what, number):
    kind = KeyboardInterrupt if number == signal.SIGINT else Stopped
    timer = threading.Timer(0.5, os.kill, (os.getpid(), number))
    begin = time.monotonic()
    with stops_in_order(), between_steps(patient=True), pytest.raises(kind):
        timer.start()
        play(what)
    timer.join()
    assert time.monotonic() - begin < 10


def test_a_signal_is_kept_until_the_run_waits_and_later_ones_do_not_count():
    before = signal.getsignal(signal.SIGTERM)
    with stops_in_order(), between_steps(patient=True):
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
        done = True  # nothing was raised here
        with pytest.raises(Stopped) as stopped, at_once():
            done = False
        os.kill(os.getpid(), signal.SIGINT)  # while things are cleared up
    assert done and stopped.value.number == signal.SIGTERM
    assert signal.getsignal(signal.SIGTERM) == before


def test_what_was_to_be_ignored_stays_ignored():
    """nohup, and what a shell starts in the background."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stops_in_order(), between_steps():
            os.kill(os.getpid(), signal.SIGHUP)
            with at_once():
                pass
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("ranks, there, package", [(1, [], "liggghts"), (2, ["liggghts"], "openmpi-bin")])
def test_a_program_that_is_missing_is_named_with_its_package(tmp_path, monkeypatch, ranks, there, package):
    for name in there:
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(UserError, match=f"is not installed; on Debian: sudo apt-get install {package}$") as fault:
        command(ranks)
    assert fault.value.status == 1


def test_the_program_dies_with_its_watcher_even_before_it_writes(play, tmp_path, monkeypatch):
    """A program that waits for a reader of its pipe would wait for ever."""
    monkeypatch.setenv("PLAY", "never opens")
    code = (
        "import os, pathlib, signal, sys; from milltools.dem.liggghts import Liggghts; "
        "folder = pathlib.Path(sys.argv[1]); p = Liggghts(folder, '', 7); "
        "print(p.process.pid, flush=True); os.kill(os.getpid(), signal.SIGSTOP)"
    )
    folder = tmp_path / "watched"
    folder.mkdir()
    reader, writer = os.pipe()
    tools = str(pathlib.Path(__file__).resolve().parents[2] / "tools")
    watcher = os.posix_spawn(
        sys.executable,
        [sys.executable, "-c", code, str(folder)],
        {**os.environ, "PYTHONPATH": tools},
        file_actions=[(os.POSIX_SPAWN_DUP2, writer, 1), (os.POSIX_SPAWN_CLOSE, reader)],
    )
    os.close(writer)
    with open(reader) as said:
        pid = int(said.readline())
    deadline = time.monotonic() + 20
    while not (folder / "screen.txt").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(watcher, signal.SIGKILL)
    os.waitpid(watcher, 0)
    while time.monotonic() < deadline:
        try:
            state = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            break
        if state in "ZX":
            break
        time.sleep(0.02)
    else:
        os.kill(pid, signal.SIGKILL)
        pytest.fail("it lives on")
