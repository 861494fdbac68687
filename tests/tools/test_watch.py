"""What `mill watch` tells of a run, whom its server answers, and the time left."""

import contextlib
import http.client
import json
import math
import re
import shutil
import socket
import threading

import h5py
import numpy as np
import pytest
from conftest import ROOT
from watching import ENDLESS, OFTEN, decoded, messages, until

from milltools import pages
from milltools.read.runfile import Run
from milltools.read.sums import standard_error
from milltools.watch import follow, left, page
from milltools.watch.follow import Follower
from milltools.watch.server import MOST, Server

pytest_plugins = ["watched"]


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


# ---- who can ask


def test_only_the_token_opens_the_page(serve, whole, capfd):
    server = serve(whole[0])
    status, headers, body = ask(server, f"/{server.token}/")
    assert status == 200 and f"/{server.token}/".encode() in body
    assert len(server.token) >= 32
    for path in (
        "/",
        "/state",
        "/mill.json",
        f"/{server.token[:-1]}/",
        f"/{server.token}x/state",
        "/%ff/",
        "//",
        "",
        "http://[/x",
    ):
        assert ask(server, path, Host=f"localhost:{server.server_port}")[0] in (400, 404), path
    for name in ("..", "../", "source.js", "%2e%2e/etc/passwd", "run.h5", "state/"):
        assert ask(server, f"/{server.token}/{name}")[0] == 404, name
    assert headers["Cache-Control"] == "no-store" and headers["Referrer-Policy"] == "no-referrer"
    assert not [name for name in headers if name.startswith("Access-Control")]
    assert capfd.readouterr().err == ""  # whoever has no token writes nothing into the terminal of the user


def test_the_page_may_do_what_it_says_and_every_other_answer_nothing(whole):
    with Server(Follower(whole[0]), page.text) as server:
        policies = [ask(server, f"/{server.token}/{name}")[1]["Content-Security-Policy"] for name in ("", "state", "x")]
    nothing = "default-src 'none'; frame-ancestors 'none'"
    assert policies == [f"{pages.declared(server.page)}; frame-ancestors 'none'", nothing, nothing]
    assert re.match(r"default-src 'none'; script-src ('sha256-[\w+/=]+' )+'wasm-unsafe-eval'; style-src", policies[0])


def test_connections_that_send_nothing_or_little_end_and_are_few(serve, whole, monkeypatch):
    server, before = serve(whole[0]), threading.active_count()
    place = "127.0.0.1", server.server_port
    with contextlib.ExitStack() as stack:
        idle = [stack.enter_context(socket.create_connection(place)) for _ in range(2 * MOST)]
        until(lambda: threading.active_count() <= before + MOST and 0 < len(server.waiting) <= MOST)
        assert ask(server, f"/{server.token}/")[0] == 200
        monkeypatch.setattr("milltools.watch.server.PATIENCE", 0.2)
        with contextlib.suppress(OSError):
            until(lambda: idle[-1].send(b"G") and not server.waiting)
    until(lambda: threading.active_count() == before)


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


@pytest.mark.parametrize("query", ["since=x", "seen=", "since=1.5", "since=" + "9" * 30, "since=" + "9" * 5000])
def test_wrong_numbers_are_refused(serve, whole, query):
    server = serve(whole[0])
    statuses = [ask(server, f"/{server.token}/state{words}")[0] for words in (f"?{query}", "")]
    assert statuses == [200 if query == "seen=" else 400, 200]  # what is empty is not given


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


@pytest.mark.slow
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


def killed(running):
    """A run that was killed after its first states: its path, its follower and the answer after that."""
    process, path = running()
    follower = Follower(path)
    until(lambda: follower.answer(-1, -1)["states"])
    process.kill()
    process.communicate()
    return path, follower, follower.answer(-1, -1)


@pytest.mark.slow
def test_a_killed_run_is_told_and_its_states_stay(running):
    path, follower, answer = killed(running)
    (failed,) = messages(answer, "failed")
    assert follower.state == "killed" and answer["ended"] and answer["states"]
    (line,) = failed["lines"]
    assert re.fullmatch(
        rf"{path}: no run writes it any more .*; it has the results up to [\d.]+ s, and .* goes on", line
    )


@pytest.mark.slow
def test_a_killed_run_that_goes_on_is_followed_again(running, start_millsim):
    _, follower, before = killed(running)
    start_millsim("-q", "--resume", "-o", "a.h5", *ENDLESS, *OFTEN, "deck.ini")  # while the file is open here
    later = until(lambda: (now := follower.answer(-1, -1))["seen"] > before["seen"] and now)
    assert follower.state == "running" and later["mill"] == before["mill"] and not messages(later, "failed")


def test_a_run_on_another_computer_is_not_taken_for_dead(running, monkeypatch):
    """Its lock is not seen, but it goes on to replace its file."""
    _, path = running()
    monkeypatch.setattr(follow, "held", lambda path: False)
    follower = Follower(path)
    until(lambda: follower.answer(-1, -1)["states"])
    until(lambda: not messages(follower.answer(-1, -1), "failed"))
    assert follower.state == "running"


@pytest.mark.slow
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


def test_the_ends_told_from_an_error_hold_the_true_end_of_two_runs_in_three():
    """The error of 96 blocks that scatter by 20 % reaches 1 % after 582 of them: 400, times the square of Student's
    2.36 over 1.96."""
    random, held = np.random.default_rng(1), 0
    for _ in range(300):
        error = standard_error(random.normal(1, 0.2, 96), 0)
        first, last = left.Precision(0.01, {"power": error}, 96.0, 10.0, True).ends(1e9)
        held += first <= 10 + 582 <= last
    assert 0.57 < held / 300 < 0.77


def test_a_run_with_a_precision_tells_it(running):
    _, path = running("-s", "run.precision=1e-6", "-s", "balls.count=100")
    follower = Follower(path)

    def note():
        (progress,) = messages(follower.answer(-1, -1), "progress")
        return "known to" in progress["note"] and progress

    progress = until(note)
    assert re.search(r"median known to [\d.]+ %, power known to [\d.]+ %; wanted: 0.0001 %$", progress["note"])
    assert "at most" in progress["note"] and progress["left"] > 0
