"""mill render is ended, fails, or is asked what cannot be: one line, no file, no process."""

import os
import resource
import signal
import subprocess
import time

import films
import pytest
from conftest import some
from films import ENVIRONMENT, MILL, SMALLEST

pytestmark = pytest.mark.render


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The runs of films.make_runs, in a folder."""
    return films.make_runs(tmp_path_factory.mktemp("runs"))


def start(start_mill, runs, *words):
    return start_mill("render", runs / "run.h5", "long.mp4", "--slow", "5000", *SMALLEST, *words)


@pytest.fixture
def start_mill(tmp_path):
    """start_mill(*arguments) starts the mill command in tmp_path; what still runs is ended after the test."""
    started = []

    def begin(*arguments):
        process = subprocess.Popen(
            [*MILL, *map(str, arguments)], cwd=tmp_path, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip
        started.append(process)
        return process

    yield begin
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


def children(pid):
    """{pid: command line} of a process's children that run."""
    words = ["ps", "-o", "pid=,stat=,args=", "--ppid", str(pid)]
    lines = subprocess.run(words, capture_output=True, text=True).stdout.splitlines()
    found = [line.split(None, 2) for line in lines]
    return {int(number): args for number, state, args in found if "Z" not in state}


def drawing(process, folder):
    """The children of a film that is being drawn; waits until it is."""
    for _ in range(600):
        found = children(process.pid)
        if any(folder.glob(".long.mp4.*.part")) and sum("render.team" in a for a in found.values()) == 2:  # fmt: skip
            return found
        assert process.poll() is None
        time.sleep(0.1)
    raise AssertionError("nothing is drawn")


@pytest.mark.parametrize(
    "number, line, status",
    some([(signal.SIGINT, "interrupted", 130), (signal.SIGTERM, "stopped", 143)], 2),
)
def test_a_signal_leaves_neither_file_nor_process(start_mill, runs, tmp_path, number, line, status):
    process = start(start_mill, runs, "--workers", "2")
    helpers = drawing(process, tmp_path)
    process.send_signal(number)
    said = process.communicate(timeout=30)[1]
    assert (process.returncode, said.splitlines()[-1]) == (status, f"mill render: {line}")
    assert list(tmp_path.iterdir()) == []
    assert not any(os.path.exists(f"/proc/{pid}") for pid in helpers)


@pytest.mark.parametrize("victim", ["render.team", "ffmpeg"])
def test_a_helper_that_dies_is_one_line(start_mill, runs, tmp_path, victim):
    process = start(start_mill, runs, "--workers", "2")
    helpers = drawing(process, tmp_path)
    os.kill(next(pid for pid, args in helpers.items() if victim in args), signal.SIGKILL)
    said = process.communicate(timeout=60)[1].splitlines()[-1]
    assert process.returncode == 1
    if victim == "ffmpeg":
        assert said.startswith("mill render: long.mp4: ffmpeg: it ended with status -9")
    else:
        assert said.startswith("mill render: a drawing process ended with signal 9 (SIGKILL)")
    assert list(tmp_path.iterdir()) == []
    assert not any(os.path.exists(f"/proc/{pid}") for pid in helpers)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "name, words", some([("film.mp4", ("--no-rerun",)), ("still.pov", ("--pov",)), ("still.png", ())], 2)
)
def test_a_full_disk_is_one_line(mill, runs, tmp_path, name, words):
    full = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))}
    done = mill("render", runs / "run.h5", name, *words, *SMALLEST, **full)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f"mill render: {name}: File too large"
    assert list(tmp_path.iterdir()) == []


def test_what_ffmpeg_is_to_write_follows_no_link(mill, runs, tmp_path):
    (tmp_path / "other").write_text("kept")
    (tmp_path / "film.mp4.part").symlink_to("other")
    assert mill("render", runs / "run.h5", "film.mp4", "--slow", "20", "--to", "10 ms", *SMALLEST).returncode == 0
    assert (tmp_path / "other").read_text() == "kept" and (tmp_path / "film.mp4.part").is_symlink()


def test_without_ffmpeg_it_is_said_before_anything_is_drawn(mill, runs, tmp_path):
    done = mill("render", runs / "run.h5", "film.mp4", env={"PATH": str(tmp_path)})
    line = "mill render: ffmpeg is not installed; on Debian: sudo apt-get install ffmpeg\n"
    assert (done.returncode, done.stderr) == (1, line)


@pytest.fixture(scope="module")
def shots(runs):
    """A camera's film beside the runs."""
    return films.make_camera(runs / "camera.mp4")


FILM = ("run.h5", "a.mp4")
BESIDE = (*FILM, "--beside", "camera.mp4")


@pytest.mark.parametrize(
    "words, line",
    [
        (("none-there.h5", "a.png"), "none-there.h5: no such file"),
        (("run.h5", "a.avi"), "a.avi: expected a name ending in .png, .mp4, .webm, .webp, .gif"),
        (("run.h5", "a.pov"),
         "a.pov: expected a name ending in .png, .mp4, .webm, .webp, .gif; to write a scene, add --pov"),
        (("run.h5", "nowhere/a.png"), "nowhere/a.png: there is no folder nowhere"),
        (("run.h5", "a.png", "--time", "1 kg"), "--time: expected a time such as '120 ms', got '1 kg'"),
        (("run.h5", "a.png", "--time", "51 ms"), "--time: the ball states of the run end at 0.05 s, got 0.051 s"),
        (("run.h5", "a.png", "--slow", "5"), "--slow: only for .mp4 and .webm"),
        (("run.h5", "a.png", "--eye", "1,2"), "--eye: expected 3 numbers such as 0.3,-0.2,0.1, got '1,2'"),
        (("run.h5", "a.png", "--target", "0,0,0"), "--target: only with --eye"),
        (("run.h5", "a.png", "--limits", "3"), "--limits: expected 2 numbers such as 0,4, got '3'"),
        ((*FILM, "--time", "1 ms"), "--time: only for .png and .pov"),
        ((*FILM, "--slow", "0"), "argument --slow: invalid positive number value: '0'"),
        ((*FILM, "--workers", "none"), "argument --workers: invalid number of processes value: 'none'"),
        ((*FILM, "--from", "30 ms", "--to", "20 ms"), "--to: must be after --from, 0.03 s; got 0.02 s"),
        ((*FILM, "--from", "41 ms", "--to", "44 ms", "--no-rerun"),
         "run.h5: fewer than two frames are stored from 0.041 s to 0.044 s"),
        ((*FILM, "--slow", "1e8"), "125000001 pictures, 4e-10 s apart, are too many for a film"),
        ((*FILM, "--crop", "1x1+0+0"), "--crop: only with --beside"),
        ((*FILM, "--beside", "no.mp4"), "no.mp4: no such file"),
        ((*FILM, "--beside", "deck.ini"), "deck.ini: ffmpeg finds no video in it"),
        ((*BESIDE, "--crop", "60x20+10+0"), "--crop: 60x20+10+0 is not within camera.mp4, 64x48 pixels"),
        ((*BESIDE, "--crop", "left"), "--crop: expected WxH+X+Y in pixels, such as 640x480+20+10, got 'left'"),
        ((*BESIDE, "--offset", "60 ms"), "--beside: no picture of the camera is in the time of the run"),
        (("run.h5", "camera.mp4", "--beside", "camera.mp4"),
         "camera.mp4: is the input file camera.mp4 itself; give another name"),
        (("none.h5", "a.png"), "none.h5: no ball states are stored (output.frames = 0 s): give a time with --time"),
        (("none.h5", "a.mp4"),
         "none.h5: no ball states are stored (output.frames = 0 s) to find the range of the colours"),
        (("none.h5", "a.mp4", "--no-rerun"), "none.h5: no ball states are stored (output.frames = 0 s)"),
        (("run.h5", "a.png", "--colour-map", "jet"), "argument --colour-map/--color-map: invalid choice: 'jet'"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_line(runs, shots, tmp_path, words, line, capsys, monkeypatch):
    from milltools import __main__

    for name in ("run.h5", "none.h5", "deck.ini", shots.name):
        (tmp_path / name).symlink_to(runs / name)
    before = sorted(tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["mill", "render", *words])
    assert __main__.main() == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith(f"mill render: {line}"), said.err
    assert len(said.err.splitlines()) == 1
    assert sorted(tmp_path.iterdir()) == before


def test_the_start_of_a_run_is_coloured_by_impacts(mill, runs, tmp_path):
    """No time passes, so no ball has hit anything; millsim itself runs no deck for 0 s."""
    words = (runs / "run.h5", "a.png", "--time", "0 s", "--colour", "impact", *SMALLEST)
    done = mill("render", *map(str, words))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.png").exists()


@pytest.mark.parametrize("words", [("a.png", "--time", "10 ms"), ("a.mp4", "--slow", "50")])
def test_a_run_without_frames_asks_for_the_limits_of_colours(mill, runs, words):
    """They are found from stored frames; with them the deck is run again."""
    done = mill("render", str(runs / "none.h5"), *words, "--size", "160x120")
    assert done.returncode == 2
    assert "--limits LOW,HIGH" in done.stderr
