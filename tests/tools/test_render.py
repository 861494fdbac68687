"""mill render makes stills and films of a run, off-screen: the right pictures, at the right times, whole or not at
all."""

import argparse
import shutil

import films
import h5py
import numpy as np
import pytest
from conftest import run_mill
from films import SMALLEST, STEP, frames, off, picture, probe
from PIL import Image

from milltools.base import text
from milltools.geometry.trajectory import stored
from milltools.read.runfile import Run
from milltools.render import states, times

pytestmark = pytest.mark.render


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The runs of films.make_runs, in a folder."""
    return films.make_runs(tmp_path_factory.mktemp("runs"))


# ---- stills


def test_a_still_is_of_the_last_frame_and_has_the_balls_colours(mill, runs, tmp_path):
    done = mill("render", runs / "run.h5", "last.png", *SMALLEST)
    size = (tmp_path / "last.png").stat().st_size
    said = f"last.png: 160 x 120 pixels at 0.05 s, {text.size(size)}\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")
    assert mill("render", runs / "run.h5", "then.png", "--time", "50 ms", *SMALLEST).returncode == 0
    assert (tmp_path / "last.png").read_bytes() == (tmp_path / "then.png").read_bytes()
    shown = picture(tmp_path / "last.png")
    assert shown.shape == (120, 160, 3)
    assert (np.ptp(shown, axis=2) > 100).mean() > 0.01  # balls: nothing else is that bright in colour
    assert sorted(p.name for p in tmp_path.iterdir()) == ["last.png", "then.png"]


def test_a_still_between_frames_is_exact(mill, runs, tmp_path):
    done = mill("render", runs / "run.h5", "a.png", "--time", "12.4 ms", *SMALLEST)
    assert done.returncode == 0 and "running the deck again up to 0.0124 s" in done.stderr
    words = ("--time", "12.4 ms", *SMALLEST)
    done = mill("render", runs / "fine.h5", "b.png", *words)
    assert (done.returncode, done.stderr) == (0, "")  # there it is stored
    assert off(picture(tmp_path / "a.png"), picture(tmp_path / "b.png")) < 0.02


def test_a_ray_traced_still_is_there_and_its_scene_too(mill, runs, tmp_path):
    words = ("--pov", "--size", "160x120", "--limits", "0,3")
    assert mill("render", runs / "run.h5", "scene.pov", *words).returncode == 0
    assert (tmp_path / "scene.pov").read_text().count("\nB(") == 20
    done = mill("render", runs / "run.h5", "traced.png", *words)
    assert (done.returncode, done.stderr) == (0, "")
    shown = picture(tmp_path / "traced.png")
    assert shown.shape == (120, 160, 3) and (np.ptp(shown, axis=2) > 100).mean() > 0.01


# ---- films


@pytest.fixture(scope="module")
def slow(runs):
    """A slow film with its words: 20 ms to 26 ms, 100 times slower."""
    words = ["render", "run.h5", "slow.mp4", "--slow", "100", "--from", "20 ms", "--to", "26 ms"]
    done = run_mill(runs, *words, *SMALLEST)
    assert done.returncode == 0, done.stderr
    return runs / "slow.mp4", done.stderr


def test_a_film_of_stored_frames_that_are_far_apart_shows_every_one(mill, runs, tmp_path):
    done = mill("render", runs / "run.h5", "film.mp4", "--no-rerun", *SMALLEST)
    assert done.returncode == 0, done.stderr
    line = "mill render: 11 pictures at 5 a second, 40 times slower than real time; --slow sets it"
    size = (tmp_path / "film.mp4").stat().st_size
    said = f"film.mp4: 11 pictures, 2.2 s, {text.size(size)}\n"
    assert (done.stdout, done.stderr.splitlines()[0]) == (said, line)
    assert probe(tmp_path / "film.mp4") == ("h264", "yuv420p", 160, 120, 11, 2.2)
    assert mill("render", runs / "run.h5", "last.png", *SMALLEST).returncode == 0
    shown, last = frames(tmp_path / "film.mp4"), picture(tmp_path / "last.png")
    assert off(shown[-1], last) < 6 < off(shown[0], last)  # but for what H.264 takes


def test_a_slow_film_shows_the_times_it_says(mill, slow, tmp_path):
    path, said = slow
    assert "16 pictures at 25 a second, 100 times slower than real time" in said
    assert probe(path) == ("h264", "yuv420p", 160, 120, 16, 0.64)
    shown = frames(path)
    done = mill("render", path.parent / "fine.h5", "at.png", "--time", "23.6 ms", *SMALLEST)
    assert (done.returncode, done.stderr) == (0, "")
    still = picture(tmp_path / "at.png")
    differences = [off(one, still) for one in shown]
    assert np.argmin(differences) == 9  # 20 ms + 9 * 0.4 ms


def test_the_number_of_processes_does_not_change_a_film(mill, slow, tmp_path):
    path, _ = slow
    words = ("--slow", "100", "--from", "20 ms", "--to", "26 ms", "-q", *SMALLEST, "--workers", "2")
    assert mill("render", path.parent / "run.h5", "two.mp4", *words).returncode == 0
    assert (tmp_path / "two.mp4").read_bytes() == path.read_bytes()


def test_webm_is_vp9_and_an_orbit_goes_around(mill, runs, tmp_path):
    words = ("--camera", "orbit", "--fps", "10", "--slow", "20", "--to", "20 ms", *SMALLEST)
    done = mill("render", runs / "run.h5", "film.webm", *words)
    assert done.returncode == 0 and "5 pictures at 10 a second, 20 times slower" in done.stderr
    assert probe(tmp_path / "film.webm") == ("vp9", "yuv420p", 160, 120, 5, 0.5)


@pytest.mark.parametrize("suffix", ["webp", "gif"])
def test_a_moving_picture_for_pages_has_every_frame_and_repeats_for_ever(mill, runs, tmp_path, suffix):
    words = ("--fps", "10", "--slow", "20", "--to", "20 ms", *SMALLEST)
    assert mill("render", runs / "run.h5", f"clip.{suffix}", *words).returncode == 0
    with Image.open(tmp_path / f"clip.{suffix}") as clip:
        assert (clip.size, clip.n_frames, clip.info["loop"]) == ((160, 120), 5, 0)
        clip.load()
        assert clip.info["duration"] == 100  # ms
        first = np.array(clip.convert("RGB")).astype(float)
        clip.seek(4)
        assert off(first, np.array(clip.convert("RGB")).astype(float)) > 1


# ---- states


def told(path, plan, impacts=False, allowed=True, flashes=0.0):
    said = []
    with Run(path) as run, states.of(run, plan, impacts, flashes, allowed, said.append, None) as moving:
        return list(moving.states(plan.times)), moving.guessed, " ".join(said)


def plan_of(path, step=STEP):
    with Run(path) as run:
        first = np.arange(1, int(run.time / step))
    return times.Plan(first * step, 25.0, 1.0, step)


def test_a_deck_run_again_gives_the_states_of_a_finer_run_to_the_bit(runs, the_program):
    found, guessed, _ = told(runs / "run.h5", plan_of(runs / "run.h5"))
    assert guessed == 0 and len(found) > 100
    with Run(runs / "fine.h5") as fine:
        for index, state in enumerate(found, start=1):
            right = stored(fine, index)
            for name in ("position", "velocity", "angular_velocity"):
                assert (getattr(state, name) == getattr(right, name)).all()


def test_without_the_deck_flights_are_shown_and_what_is_not_known_is_said(runs, the_program):
    found, guessed, _ = told(runs / "run.h5", plan_of(runs / "run.h5"), allowed=False)
    more = np.zeros(10)  # share of the balls with more than one contact in each gap
    with Run(runs / "log.h5") as run:
        log = {n: run.read(f"impacts/{n}") for n in ("time", "ball", "partner", "kind")}
    for gap in range(10):
        rows = (log["time"] >= 5e-3 * gap) & (log["time"] < 5e-3 * (gap + 1))
        both = np.concatenate([log["ball"][rows], log["partner"][rows & (log["kind"] == 0)]])
        more[gap] = (np.bincount(both, minlength=20) > 1).mean()
    assert guessed == pytest.approx(more.mean(), rel=0.1) and guessed > 0.02
    with Run(runs / "fine.h5") as fine:
        off_by = [np.abs(s.position - stored(fine, k).position).max(axis=1) for k, s in enumerate(found, 1)]
    assert (np.concatenate(off_by) < 1e-7).mean() > 1 - guessed  # frames themselves are known too


@pytest.mark.parametrize("what", ["frame", "series", "program", "deck"])
def test_what_is_another_run_is_not_taken_for_this_one(runs, the_program, tmp_path, what):
    path = tmp_path / "other.h5"
    shutil.copy(runs / "run.h5", path)
    with h5py.File(path, "r+") as file:
        if what == "frame":
            file["particles/trajectory/position/value"][4, 7, 2] += 1e-6
            reason = "the states of the balls differ at 0.02 s"
        elif what == "series":
            file["observables/kinetic_energy/value"][33] *= 1 + 1e-6
            reason = "the kinetic energy differs from 0.033 s on"
        elif what == "program":
            file["run/program"] = "LIGGGHTS"
            reason = "LIGGGHTS made the run, not millsim"
        else:
            text = file["deck/text"].asstr()[()].replace("seed = 1 ", "seed = 2 ")
            del file["deck/text"]
            file["deck/text"] = text
            reason = "(the deck, run again, gave other results: "
    found, guessed, said = told(path, plan_of(path))
    assert "the balls between stored frames are computed from their free flights" in said and reason in said
    assert len(found) == len(plan_of(path).times) and guessed > 0.02


def test_the_last_impact_of_every_ball_is_that_of_the_log(runs, the_program):
    plan = plan_of(runs / "log.h5", 3.1e-3)
    with Run(runs / "log.h5") as run:
        log = [run.read(f"impacts/{n}") for n in ("time", "ball", "partner", "kind", "normal_speed")]
    right, row = np.full(20, np.nan), 0
    again, _, said = told(runs / "run.h5", plan, impacts=True)  # which has no log
    assert "for exact states and impacts" in said
    stored_log, _, _ = told(runs / "log.h5", plan, impacts=True)
    assert len(again) == len(stored_log) > 10
    for one, two in zip(again, stored_log):
        while row < len(log[0]) and log[0][row] < one.time:
            _, ball, partner, kind, speed = (column[row] for column in log)
            right[ball] = speed
            if kind == 0:
                right[partner] = speed
            row += 1
        np.testing.assert_array_equal(one.value, right)
        np.testing.assert_array_equal(two.value, right)
    with Run(runs / "log.h5") as run:  # looked for from a late moment backwards
        np.testing.assert_array_equal(states.LastImpacts(run).until(one.time), right)


def test_the_impacts_that_dissipate_most_flash_and_shrink(runs, the_program):
    plan, life = plan_of(runs / "log.h5"), 1e-3
    found, _, _ = told(runs / "log.h5", plan, flashes=life)
    with Run(runs / "log.h5") as run:
        time, energy, place = (run.read(f"impacts/{n}") for n in ("time", "dissipation", "position"))
        made = states.Flashes(run, run, 0.0, 0.01, 2e-4)
    early = np.sort(energy[time < 0.01])[::-1][:50]  # one at a time: there are 20 balls
    assert len(made.time) == len(early) and made.least == pytest.approx(early[-1])
    hardest = int(np.argmax(energy))
    seen = [state.flashes[np.abs(state.flashes[:, :3] - place[hardest]).max(axis=1) < 1e-9] for state in found]
    shown = [(state.time, *one[:, 3]) for state, one in zip(found, seen) if len(one)]
    assert all(time[hardest] <= at < time[hardest] + life for at, _ in shown) and len(shown) >= 2
    assert shown[0][1] > shown[-1][1] > 0
    again, _, said = told(runs / "run.h5", plan, flashes=life)  # which has no log
    assert "and impacts" in said
    np.testing.assert_array_equal(again[50].flashes, found[50].flashes)
    bare, _, _ = told(runs / "run.h5", plan, allowed=False, flashes=life)
    assert bare[50].flashes is None


def test_a_film_without_a_given_speed_is_slow_enough_to_see_and_lasts_ten_seconds(runs, monkeypatch):
    def planned(begin=None, end=None, fps=None):
        options = argparse.Namespace(slow=None, begin=begin, end=end, fps=fps)
        said = []
        with Run(runs / "run.h5") as run:
            return times.film(run, options, True, said.append), said

    for begin, end in ((None, None), ("10 ms", "30 ms"), ("10 ms", "13 ms")):
        plan, said = planned(begin, end)
        assert 8 <= len(plan.times) / plan.fps <= 12.5 and not said
    monkeypatch.setattr(Run, "period", 0.005)  # [s]: a rotor twenty times as fast
    plan, said = planned()
    assert plan.times[-1] == pytest.approx(0.05) and plan.times[0] > 0.01 and "the film shows the time from" in said[0]
    assert 8 <= len(plan.times) / plan.fps <= 12.5
    plan, said = planned("0 s")
    assert plan.times[0] == 0 and len(plan.times) / plan.fps > 15 and not said


def test_a_run_without_frames_is_run_again_for_them(runs, the_program):
    with Run(runs / "none.h5") as run:
        plan = times.still(run, "10 ms", True)
    (state,), _, _ = told(runs / "none.h5", plan)
    with Run(runs / "fine.h5") as fine:
        assert (state.position == stored(fine, 25).position).all()


# ---- beside a camera


@pytest.fixture
def camera(tmp_path):
    """camera.mp4 in tmp_path."""
    return films.make_camera(tmp_path / "camera.mp4")


def test_simulation_and_camera_go_in_step(mill, runs, camera, tmp_path):
    words = ("--beside", "camera.mp4", "--offset", "45 ms", "--camera-fps", "1250", "--crop", "40x24+12+12")
    done = mill("render", runs / "run.h5", "both.mp4", *words, *SMALLEST)
    assert done.returncode == 0, done.stderr
    # the run ends at 50 ms, 6 pictures after 45 ms; the film plays as the camera's does
    assert "7 pictures at 25 a second, 50 times slower than real time" in done.stderr
    width = 160 + 4 + 200  # 40 x 24, 120 pixels high
    assert probe(tmp_path / "both.mp4") == ("h264", "yuv420p", width, 120, 7, 0.28)
    shown = frames(tmp_path / "both.mp4")
    levels = shown[:, 60:110, 200:340].mean(axis=(1, 2, 3))
    np.testing.assert_allclose(levels, 10 * np.arange(7), atol=3)
    assert shown[:, 30:, 170:].max() < 100  # the bright edge is cropped away
    at = ("--time", "48.2 ms", "--size", "160x120", "--quality", "draft", "--limits", "0,3")
    assert mill("render", runs / "run.h5", "at.png", *at).returncode == 0
    still = picture(tmp_path / "at.png")[30:]  # below the label
    differences = [off(one[30:, :160], still) for one in shown]
    assert np.argmin(differences) == 4  # 45 ms + 4 / 1250 s


def test_what_the_camera_took_before_the_run_is_left_out_and_its_end_is_the_film_s(runs, camera):
    with Run(runs / "run.h5") as run:
        plan, first = times.camera(run, -5e-3, 1000.0, 25.0, 20, True)
        assert first == 5 and len(plan.times) == 15
        np.testing.assert_allclose(plan.times, np.arange(15) * 1e-3, atol=1e-12)
        plan, first = times.camera(run, 12.3e-3, 1000.0, 25.0, 20, True)
        np.testing.assert_allclose(plan.times, 12.3e-3 + np.arange(20) * 1e-3, atol=1e-12)
        np.testing.assert_allclose(plan.times / plan.step, np.round(plan.times / plan.step))
