"""`mill watch`: the page of a run that goes on, its server, and what it is told about the run."""

import base64
import contextlib
import http.client
import json
import math
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SLOWER, SMALL

from milltools.read.runfile import Run
from milltools.watch import follow, left, page
from milltools.watch.follow import Follower
from milltools.watch.server import Server

pytest_plugins = ["browser"]

KINDS = {"f4": "<f4", "f8": "<f8", "u4": "<u4", "u1": "u1"}
ENDLESS = ("-s", "run.time=10000 s", "-s", "output.frames=1 s", "-s", "output.series=1 s")
OFTEN = ("-s", "output.checkpoint=0.2 s")


def decoded(value):
    """A value of the server's JSON with its arrays as numpy arrays."""
    if isinstance(value, list):
        return [decoded(one) for one in value]
    if isinstance(value, dict):
        if len(value) == 1 and (kind := next(iter(value))) in KINDS:
            return np.frombuffer(base64.b64decode(value[kind], validate=True), KINDS[kind])
        return {name: decoded(one) for name, one in value.items()}
    return value


def until(true, seconds=30.0):
    """Waits until a function is true; returns its value."""
    end = time.monotonic() + seconds * SLOWER
    while not (found := true()):
        assert time.monotonic() < end, "never came true"
        time.sleep(0.05)
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(output file of a finished run, what `millsim --json` said about it)."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "deck.ini").write_text(SMALL)
    words = [PROGRAM, "-q", "--json", "-o", "run.h5", "-s", "run.time=100 ms", "deck.ini"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True)
    return folder / "run.h5", json.loads(done.stdout)


@pytest.fixture
def serve():
    """serve(path) serves the run of an output file; get(server, name) asks it."""
    with contextlib.ExitStack() as stack:
        yield lambda path: stack.enter_context(Server(Follower(path), lambda place: f"<title>{place}</title>"))


def ask(server, path, method="GET", **headers):
    """(status, headers, body) of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    connection.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    with contextlib.closing(connection):
        return answer.status, dict(answer.getheaders()), answer.read()


def get(server, name):
    status, _, body = ask(server, f"/{server.token}/{name}")
    assert status == 200
    return decoded(json.loads(body))


def messages(answer, kind):
    return [message for message in answer["news"] if message["type"] == kind]


# ---- who can ask


def test_only_the_token_opens_the_page(serve, whole):
    server = serve(whole[0])
    status, headers, body = ask(server, f"/{server.token}/")
    assert status == 200 and f"/{server.token}/".encode() in body
    assert len(server.token) >= 32
    for path in ("/", "/state", "/mill.json", f"/{server.token[:-1]}/", f"/{server.token}x/state", "/%ff/", "//", ""):
        assert ask(server, path)[0] in (400, 404), path
    for name in ("..", "../", "source.js", "%2e%2e/etc/passwd", "run.h5", "state/"):
        assert ask(server, f"/{server.token}/{name}")[0] == 404, name
    assert headers["Cache-Control"] == "no-store" and headers["Referrer-Policy"] == "no-referrer"
    assert not [name for name in headers if name.startswith("Access-Control")]


def test_tokens_differ(serve, whole):
    assert serve(whole[0]).token != serve(whole[0]).token


def test_it_listens_on_this_computer_only(serve, whole):
    server = serve(whole[0])
    assert server.socket.getsockname()[0] == "127.0.0.1" and server.address.startswith("http://127.0.0.1:")
    for *_, (address, *_) in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET):
        if not address.startswith("127."):
            with pytest.raises(OSError), socket.create_connection((address, server.server_port), timeout=2):
                pass


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", ""])
def test_another_host_is_refused(serve, whole, host):
    server = serve(whole[0])
    assert ask(server, f"/{server.token}/state", Host=host.format(port=server.server_port))[0] == 403
    assert ask(server, f"/{server.token}/state", Host=f"localhost:{server.server_port}")[0] == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "HEAD"])
def test_it_answers_get_only(serve, whole, method):
    server = serve(whole[0])
    assert ask(server, f"/{server.token}/state", method)[0] == 501


@pytest.mark.parametrize("query", ["since=x", "seen=", "since=1.5", "since=" + "9" * 5000])
def test_wrong_numbers_are_refused(serve, whole, query):
    server = serve(whole[0])
    assert ask(server, f"/{server.token}/state?{query}")[0] in (200, 400)
    assert ask(server, f"/{server.token}/state")[0] == 200


# ---- what it tells of a finished run


def test_the_states_are_the_frames_of_the_file(serve, whole):
    server, states, since = serve(whole[0]), [], -1
    while True:
        answer = get(server, f"state?since={since}")
        states, since = states + answer["states"], answer["next"]
        if not answer["states"]:
            break
    with Run(whole[0]) as run:
        assert [state["time"] for state in states] == run.frame_times().tolist()
        for k, state in enumerate(states):
            assert np.array_equal(state["positions"].reshape(-1, 3), run.frame(k, "position"))
            speeds = np.linalg.norm(run.frame(k).astype(float), axis=1)
            assert np.array_equal(state["speeds"], speeds.astype("<f4"))
            assert np.array_equal(state["poses"].reshape(3, 4), run.poses(k)["rotor"].astype("<f4"))
            row = round(state["time"] / 1e-3)
            for form, value in state["energy"].items():
                assert value == run.series(f"{form}_energy")[1][row]
            assert state["work"] == run.drive_work()[1][row] and state["motionWork"] == [state["work"]]
            assert state["dissipation"] == [run.series(f"dissipation/{kind}")[1][row] for kind in run.kinds]
            assert state["contacts"] == sum(run.series(f"collisions/{kind}")[1][row] for kind in run.kinds)
        assert [state["ended"] for state in states] == [False] * (len(states) - 1) + [True]


def test_the_mill_is_that_of_the_file(serve, whole):
    answer = get(serve(whole[0]), "mill.json")
    mill, head = answer["message"], answer["message"]["head"]
    with Run(whole[0]) as run:
        assert mill["deck"] == run.deck_text() and mill["kinds"] == list(run.kinds)
        assert head["drawn"] == len(run.balls("id")) == sum(count for count, *_ in head["runs"])
        assert {f"{one['section']}.{one['key']}": one["value"] for one in mill["keys"]} == run.deck()
    keys = {f"{one['section']}.{one['key']}": one for one in mill["keys"]}
    assert [keys["drum.radius"][name] for name in ("value", "type", "unit")] == ["0.03 m", "number", "m"]
    assert keys["drum.radius"]["meaning"] == "inner radius of the drum"
    assert (keys["gravity.acceleration"]["type"], keys["drum.profile"]["type"]) == ("vector", "name")
    assert mill["motions"] == ["rotor"] and mill["species"][0]["count"] == 20
    for body in head["bodies"]:
        assert body["corners"].max() < len(body["points"]) / 3
    steel = next(body for body in head["bodies"] if body["look"] == "steel")
    reach = np.hypot(*steel["points"].reshape(-1, 3)[:, 1:].T).max()
    assert reach == pytest.approx(math.hypot(0.022, 0.002), rel=1e-3) and steel["motion"] == 0


def test_the_results_are_those_of_the_summary(serve, whole):
    path, summary = whole
    (results,) = messages(get(serve(path), "state"), "results")
    assert results["statistics"] == summary["statistics"] and results["notes"] == summary["notes"]
    spectrum, counts = results["spectrum"], summary["statistics"]["impacts"]
    for kind, of in counts.items():
        assert spectrum["count"][kind].sum() == of["count"]
        assert spectrum["dissipation"][kind].sum() == pytest.approx(of["dissipated_power"] * 0.1, rel=1e-9)
    assert len(spectrum["edges"]) == len(spectrum["count"]["all"]) + 1 and np.isfinite(spectrum["edges"]).all()


def test_results_come_once(serve, whole):
    server = serve(whole[0])
    first = get(server, "state")
    assert not messages(get(server, f"state?seen={first['seen']}"), "results")


def test_a_finished_run_is_said_to_be_finished(serve, whole):
    answer = get(serve(whole[0]), "state")
    (progress,) = messages(answer, "progress")
    assert progress["done"] == 1 and progress["note"] == "complete at 0.1 s" and answer["ended"]


# ---- a run that goes on


@pytest.fixture
def running(start_millsim, write_deck, tmp_path):
    """running(*options) starts an endless run with short checkpoints; returns its process and the path of its file."""

    def start(*options):
        write_deck()
        return start_millsim("-q", "-o", "a.h5", *ENDLESS, *OFTEN, *options, "deck.ini"), tmp_path / "a.h5"

    return start


def test_a_running_run_is_followed(running):
    process, path = running()
    follower = Follower(path)
    first = until(lambda: (now := follower.answer(-1, -1)) and now["states"] and now)
    second = until(lambda: (now := follower.answer(first["next"], first["seen"]))["states"] and now)
    assert second["seen"] > first["seen"] and second["mill"] == first["mill"] != ""
    assert second["states"][0]["time"] > first["states"][-1]["time"]
    assert not second["ended"] and not any(state["ended"] for state in second["states"])
    (progress,) = messages(second, "progress")
    assert progress["left"] > 0 and 0 < progress["done"] < 1 and "about" in progress["note"]
    (results,) = messages(second, "results")
    assert results["statistics"]["duration"] > messages(first, "results")[0]["statistics"]["duration"]
    assert second["states"][-1]["factor"] > 0 and second["states"][-1]["rate"] > 0
    process.terminate()
    process.communicate()
    last = follower.answer(second["next"], second["seen"])
    assert last["ended"] and follower.state == "stopped" and "stopped at" in messages(last, "progress")[0]["note"]


def test_the_mill_is_known_before_the_first_checkpoint(running):
    _, path = running("-s", "output.checkpoint=1000 s")
    follower = Follower(path)
    name, mill = until(follower.mill)
    until(lambda: follower.mill()[1])
    name, mill = follower.mill()
    assert name and mill["head"]["drawn"] == 20 and mill["head"]["bodies"]
    (progress,) = messages(follower.answer(-1, -1), "progress")
    assert progress["note"] == f"{path}: waiting for the first checkpoint" and progress["left"] is None


def test_a_file_that_does_not_exist_yet_is_waited_for(running, tmp_path):
    follower = Follower(tmp_path / "a.h5")
    answer = follower.answer(-1, -1)
    (progress,) = messages(answer, "progress")
    assert progress["note"] == f"{tmp_path / 'a.h5'}: does not exist yet: waiting for its run"
    assert (answer["mill"], answer["states"], answer["ended"]) == ("", [], False)
    assert follower.mill() == ("", None)
    running()
    until(lambda: follower.answer(-1, -1)["states"])


def test_a_killed_run_is_told_and_its_states_stay(running):
    process, path = running()
    follower = Follower(path)
    until(lambda: follower.answer(-1, -1)["states"])
    process.kill()
    process.communicate()
    answer = follower.answer(-1, -1)
    (failed,) = messages(answer, "failed")
    assert follower.state == "killed" and answer["ended"] and answer["states"]
    (line,) = failed["lines"]
    assert re.fullmatch(
        rf"{path}: no run writes it any more .*; it has the results up to [\d.]+ s, and .* goes on", line
    )


def test_a_killed_run_that_goes_on_is_followed_again(running, start_millsim):
    process, path = running()
    follower = Follower(path)
    until(lambda: follower.answer(-1, -1)["states"])
    process.kill()
    process.communicate()
    killed = follower.answer(-1, -1)
    start_millsim("-q", "--resume", "-o", "a.h5", *ENDLESS, *OFTEN, "deck.ini")  # while the file is open here
    later = until(lambda: (now := follower.answer(-1, -1))["seen"] > killed["seen"] and now)
    assert follower.state == "running" and later["mill"] == killed["mill"] and not messages(later, "failed")


def test_a_run_on_another_computer_is_not_taken_for_dead(running, monkeypatch):
    """Its lock is not seen, but it goes on to replace its file."""
    _, path = running()
    monkeypatch.setattr(follow, "held", lambda path: False)
    follower = Follower(path)
    until(lambda: follower.answer(-1, -1)["states"])
    until(lambda: not messages(follower.answer(-1, -1), "failed"))
    assert follower.state == "running"


def test_another_run_in_the_same_file_is_another_mill(running, start_millsim, whole, tmp_path):
    shutil.copy(whole[0], tmp_path / "a.h5")
    follower = Follower(tmp_path / "a.h5")
    old = follower.answer(-1, -1)
    running("--force")
    new = until(lambda: (now := follower.answer(-1, -1))["mill"] != old["mill"] and now)
    assert new["mill"] and new["seen"] > old["seen"]


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_half_copied_file_is_read_when_it_is_whole(whole, tmp_path, share):
    path, content = tmp_path / "a.h5", whole[0].read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    follower = Follower(path)
    answer = follower.answer(-1, -1)
    assert not answer["states"]
    path.write_bytes(content)
    assert follower.answer(-1, -1)["states"] and follower.state == "complete"


def test_a_file_that_is_no_run_is_told(tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes(b"no run")
    (progress,) = messages(Follower(path).answer(-1, -1), "progress")
    assert progress["note"].startswith(f"waiting: {path}: not a readable HDF5 file")


def test_damage_is_a_line_of_the_page(whole, tmp_path):
    path = tmp_path / "a.h5"
    shutil.copy(whole[0], path)
    with h5py.File(path, "r+") as file:
        file["observables/pose/rotor/rotation/value"][...] = 7.0
    (failed,) = messages(Follower(path).answer(-1, -1), "failed")
    assert "not a rotation matrix" in failed["lines"][0]


def test_a_moving_mill_is_drawn_where_its_motions_go(millsim, tmp_path):
    """The jar of a planetary mill goes around the sun; the space that it sweeps is known from the start."""
    words = ("-s", "run.time=5 ms", "-s", "run.sample_from=0 s", "-o", tmp_path / "a.h5")
    millsim("-q", *words, ROOT / "input/planetary.ini")
    follower = Follower(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        del file["VTKHDF"]  # as before the end
    lab, riding = (decoded(hull).reshape(-1, 3) for hull in follower.mill()[1]["head"]["hulls"])
    assert np.ptp(lab, axis=0).max() > 1.5 * np.ptp(riding, axis=0).max()


# ---- the time left


def test_an_estimate_from_one_publication_is_wider_than_one_from_several_alike():
    pace = left.Pace()
    pace.add(10.0, 1.0, 1e6)
    once = pace.left(3.0, 3.0, 0.0)
    assert once[0] < 20 < once[1]
    pace.add(20.0, 2.0, 2e6)
    assert pace.left(3.0, 3.0, 0.0) == pytest.approx((10, 10))
    assert pace.left(3.0, 3.0, 4.0) == pytest.approx((6, 6))  # the news is 4 s old
    assert pace.rates == pytest.approx((0.1, 1e5))


def test_an_uneven_pace_and_old_news_widen_it():
    pace = left.Pace()
    for wall, time_ in ((10.0, 1.0), (20.0, 2.0), (40.0, 3.0)):
        pace.add(wall, time_, 0.0)
    assert pace.left(5.0, 5.0, 0.0) == pytest.approx((20, 40))
    assert pace.left(5.0, 5.0, 50.0) == pytest.approx((0, 40))


def test_another_run_has_another_pace():
    pace = left.Pace()
    pace.add(100.0, 5.0, 0.0)
    pace.add(1.0, 0.1, 0.0)
    assert pace.rates[0] == pytest.approx(0.1)
    assert left.Pace().left(1.0, 1.0, 0.0) is None


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (200, 210, "about 3 min left"),
        (60, 200, "about 60 s to 3 min left"),
        (0, 1.5, "about 1 s left"),
        (0, 30, "at most 30 s left"),
    ],
)
def test_the_time_left_in_words(low, high, words):
    assert left.told(low, high) == words


def test_a_precision_is_told_with_what_is_wanted_and_ends_the_run_early():
    known = left.Precision(0.01, {"median": 0.02, "power": 0.01}, 3.0, 0.5, True)
    assert str(known) == "median known to 2 %, power known to 1 %; wanted: 1 %"
    first, last = known.ends(100.0)
    assert first < 0.5 + 4 * 3.0 < last < 100  # twice the error: four times the window
    assert known.ends(5.0)[1] == 5.0
    early = left.Precision(0.01, {"median": math.nan}, 0.1, 0.0, False)
    assert str(early) == "start-up not over; wanted: 1 %" and early.ends(9.0) == (0.1, 9.0)


def test_a_run_with_a_precision_tells_it(running):
    _, path = running("-s", "run.precision=1e-6", "-s", "balls.count=100")
    follower = Follower(path)

    def note():
        (progress,) = messages(follower.answer(-1, -1), "progress")
        return "known to" in progress["note"] and progress

    progress = until(note)
    assert re.search(r"median known to [\d.]+ %, power known to [\d.]+ %; wanted: 0.0001 %$", progress["note"])
    assert "at most" in progress["note"] and progress["left"] > 0


# ---- the command


@pytest.fixture
def watch(tmp_path):
    """watch(*words) starts `mill watch --no-browser` in tmp_path; returns the process and its address. Ended after the
    test."""
    started = []

    def start(*words, browser=False):
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM)}
        process = subprocess.Popen(
            [sys.executable, "-m", "milltools", "watch", *["--no-browser"] * (not browser), *map(str, words)],
            cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True,
        )  # fmt: skip
        started.append(process)
        return process, process.stdout.readline().strip()

    yield start
    for process in started:
        process.kill()
        process.communicate()


def differences(one, other):
    """Paths of all values outside of /run that differ between two output files, but the interval of checkpoints."""
    found = []
    with h5py.File(one) as a, h5py.File(other) as b:
        names = [set(), set()]
        for file, own in zip((a, b), names):
            file.visit(own.add)
        found += names[0] ^ names[1]
        for name in names[0] & names[1]:
            if isinstance(a[name], h5py.Dataset) and not name.startswith("run/"):
                same = a[name][()], b[name][()]
                if np.asarray(same[0]).tobytes() != np.asarray(same[1]).tobytes() and same[0] != same[1]:
                    found.append(name)
    return set(found) - {"deck/text", "deck/output/checkpoint"}


@pytest.mark.slow
def test_a_deck_is_run_to_the_same_bits(watch, millsim, small_deck, tmp_path):
    options = ("-s", "run.time=40 s", "-s", "output.frames=200ms", "-s", "output.series=200ms")
    process, address = watch("-o", "a.h5", *options, *OFTEN, "--until-done", "deck.ini")
    said, complaints = process.communicate(timeout=120 * SLOWER)
    assert process.returncode == 0 and re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", address), complaints
    assert "rotor power" in said  # the summary of millsim
    millsim("-q", "-o", "b.h5", *options, "deck.ini")
    assert differences(tmp_path / "a.h5", tmp_path / "b.h5") == set()
    with Run(tmp_path / "a.h5") as run:
        assert run.status == "complete" and run.about("checkpoints") > 0


@pytest.mark.parametrize(
    ("options", "interval"),
    [((), 2.0), (("-s", "output.checkpoint=1 s"), 1.0), (("-s", "output.checkpoint=90 s"), 90.0)],
)
def test_checkpoints_are_frequent_unless_the_user_says_otherwise(watch, small_deck, tmp_path, options, interval):
    process, _ = watch("-o", "a.h5", "--until-done", *options, "deck.ini")
    process.communicate(timeout=60 * SLOWER)
    with Run(tmp_path / "a.h5") as run:
        assert run.quantity("output/checkpoint") == interval


@pytest.mark.slow
def test_ctrl_c_saves_a_deck_and_says_how_to_go_on(watch, small_deck, tmp_path):
    options = ("-s", "run.time=300 s", "-s", "output.frames=200ms", "-s", "output.series=200ms")
    process, _ = watch("-o", "a.h5", *options, "deck.ini")
    until((tmp_path / "a.h5").exists)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, complaints = process.communicate(timeout=60 * SLOWER)
    assert process.returncode == 130
    last = complaints.strip().splitlines()[-1]
    assert last.startswith("mill watch: the run is stopped; this goes on with it: ")
    with Run(tmp_path / "a.h5") as run:
        assert run.status == "stopped" and 0 < run.time < 300
    words = shlex.split(last.partition("with it: ")[2])
    subprocess.run([PROGRAM, "-q", *words[1:]], cwd=tmp_path, check=True, capture_output=True)
    with Run(tmp_path / "a.h5") as run:
        assert run.status == "complete" and run.time == 300


def test_a_deck_that_was_killed_fails(watch, small_deck, tmp_path):
    process, address = watch("-o", "a.h5", *ENDLESS, "--until-done", "deck.ini")
    until((tmp_path / "a.h5").exists)
    (child,) = open(f"/proc/{process.pid}/task/{process.pid}/children").read().split()
    os.kill(int(child), signal.SIGKILL)
    _, complaints = process.communicate(timeout=60 * SLOWER)
    assert process.returncode == 137 and "millsim was ended by signal 9" in complaints


def test_a_finished_run_is_watched_until_ctrl_c(watch, whole):
    process, address = watch(whole[0])
    assert process.stderr.readline() == f"mill watch: {whole[0]}: complete at 0.1 s\n"
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60 * SLOWER)
    assert (process.returncode, said) == (0, ("", ""))


def test_until_done_ends_with_a_finished_run(mill, whole):
    done = mill("watch", "--no-browser", "--until-done", "--json", whole[0])
    assert done.returncode == 0
    facts = {"command": "watch", "files": [], "run": str(whole[0]), "state": "complete", "time": 0.1}
    assert json.loads(done.stdout) == facts


def test_a_missing_run_is_waited_for_in_a_clear_line(watch, small_deck, tmp_path, millsim):
    process, _ = watch("--until-done", "later.h5")
    assert process.stderr.readline() == "mill watch: later.h5: does not exist yet: waiting for its run\n"
    millsim("-q", "-o", "later.h5", "deck.ini")
    process.communicate(timeout=60 * SLOWER)
    assert process.returncode == 0


def test_the_browser_is_opened_without_the_token_on_its_command_line(watch, whole, tmp_path, monkeypatch):
    program = tmp_path / "browser"
    program.write_text('#!/bin/sh\nprintf %s "$1" > words.tmp; cp "${1#file://}" page.html; mv words.tmp words\n')
    program.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{program} %s &")
    _, address = watch(whole[0], browser=True)
    words = until(lambda: (tmp_path / "words").exists() and (tmp_path / "words").read_text())
    token = address.split("/")[3]
    assert words.startswith("file://") and token not in words
    assert f"url={address}" in (tmp_path / "page.html").read_text()
    folder = os.path.dirname(words.removeprefix("file://"))
    assert os.stat(folder).st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("none.ini",), "none.ini: cannot be read"),
        (("-s", "drum.radius=75 s", "deck.ini"), "[drum] radius: expected"),
        (("-o", "deck.ini", "deck.ini"), "deck.ini: exists already; --force overwrites it"),
        (("-f", "-o", "deck.ini", "deck.ini"), "deck.ini"),
        (("-f", "later.h5"), "later.h5: is the output file of a run; -s, -o and -f are for decks"),
        (("--port", "70000", "later.h5"), "--port 70000: "),
    ],
)
def test_wrong_usage_is_one_line(mill, small_deck, words, line):
    done = mill("watch", "--no-browser", "--until-done", *words)
    assert done.returncode in (1, 2) and line in done.stderr and len(done.stderr.strip().splitlines()) == 1
    assert small_deck.read_text() == SMALL


# ---- the page's side


HARNESS = """
window.heard = []; window.times = [];
const source = new WatchSource(window.MILL_WATCH);
source.on = (m) => { window.heard.push(m); window.times.push(performance.now()); };
window.source = source;
source.run();
"""


@contextlib.contextmanager
def tab_of(chromium, path, more=""):
    """A page of playwright with the source of a served run, which keeps what it hears."""
    with Server(Follower(path), lambda place: "") as server:
        texts = [*page.scripts(f"/{server.token}/"), HARNESS, more]
        scripts = "".join(f"<script>{text}</script>" for text in texts)
        server.page = f'<!doctype html><meta charset="utf-8">{scripts}'
        tab = chromium.new_context().new_page()
        tab.goto(server.address)
        tab.server = server
        yield tab
        tab.context.close()


@pytest.fixture
def tab(chromium, whole):
    with tab_of(chromium, whole[0]) as found:
        yield found


@pytest.fixture(scope="module")
def played(chromium, whole):
    """The page of a finished run after its last state."""
    with tab_of(chromium, whole[0]) as found:
        until(lambda: found.evaluate("heard.some((m) => m.ended)"))
        yield found


def heard(tab, kind):
    return tab.evaluate(f"heard.filter((m) => m.type === '{kind}').length")


def test_the_page_hears_the_mill_and_then_every_state_in_order(played, whole):
    with Run(whole[0]) as run:
        times = played.evaluate("heard.filter((m) => m.type === 'state').map((m) => m.time)")
        assert times == run.frame_times().tolist()
        last = played.evaluate("[...heard.findLast((m) => m.type === 'state').positions]")
        assert np.array_equal(np.array(last, "<f4").reshape(-1, 3), run.frame(-1, "position"))
    order = played.evaluate("heard.map((m) => m.type)")
    assert order.index("mill") < order.index("state") and order.count("mill") == 1 and order.count("results") == 1
    assert played.evaluate("heard.find((m) => m.type === 'mill').head.colours instanceof Uint8Array")
    assert played.evaluate("heard.find((m) => m.type === 'results').spectrum.count.all instanceof Float64Array")
    assert played.evaluate("source.live") is False


def test_states_are_shown_evenly(played):
    gaps = np.diff(played.evaluate("times.filter((_, k) => heard[k].type === 'state')"))
    assert 30 < np.median(gaps) < 150


def test_a_pause_holds_the_states_and_the_end_can_be_played_again(tab):
    until(lambda: heard(tab, "state") > 3)
    tab.evaluate("source.pause()")
    before = heard(tab, "state")
    tab.wait_for_timeout(300)
    assert heard(tab, "state") == before
    tab.evaluate("source.run()")
    until(lambda: tab.evaluate("heard.some((m) => m.ended)"))
    until(lambda: tab.evaluate("source.run(), heard.filter((m) => m.ended).length") > 1)


def test_without_play_the_first_state_is_shown(chromium, whole):
    with tab_of(chromium, whole[0], "source.pause();") as tab:
        until(lambda: heard(tab, "state"))
        tab.wait_for_timeout(300)
        assert heard(tab, "state") == 1


def test_the_page_of_the_studio_shows_the_run(chromium, whole):
    """In a browser that obeys the page's policy: balls, results and the end of the run, and no complaint."""
    with Server(Follower(whole[0]), page.text) as server:
        context, complaints = chromium.new_context(reduced_motion="no-preference"), []
        tab = context.new_page()
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda fault: complaints.append(str(fault)))
        tab.goto(server.address)
        assert until(lambda: tab.evaluate("window.millStudio?.ready"))
        until(
            lambda: tab.evaluate(
                "millStudio.stage.draws > 0 && millStudio.stage.shown.time >= 0.1 && !millStudio.playing"
            )
        )
        with Run(whole[0]) as run:
            assert np.array_equal(
                tab.evaluate("[...millStudio.stage.shown.positions]"), run.frame(-1, "position").ravel()
            )
            assert tab.evaluate("millStudio.record.statistics.drive.power") == float(run.statistic("drive/power"))
            assert tab.evaluate("millStudio.deck") == run.deck_text()
        assert tab.evaluate("document.getElementById('left').textContent") == "100 %, complete at 0.1 s"
        assert tab.evaluate("document.getElementById('notice').hidden")
        assert tab.evaluate("[...document.querySelectorAll('.engine')].every((one) => one.offsetParent === null)")
        assert not complaints
        context.close()


def test_the_page_says_when_the_command_has_gone(tab):
    until(lambda: heard(tab, "mill"))
    tab.server.shutdown()
    tab.server.server_close()
    until(lambda: tab.evaluate("heard.at(-1).note ?? ''").startswith("mill watch does not answer"))
