"""`millsim --digest`: streams of other programs' runs, right ones and as wrong as they come.

Whole runs of millsim, handed over and digested again, are in tests/tools/test_digested_runs.py.
"""

import math
import signal
import struct
import subprocess
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM

MAGIC = b"millsim stream 1\n"
KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")
N = 4
DECK = """\
[run]
time = 0.2 s
sample_from = 0.02 s
[balls]
count = 4
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 30 mm
length = 40 mm
[rotor]
speed = 1200 rpm
shaft_radius = 5 mm
[contact]
restitution = 0.8
[output]
frames = 50 ms
series = 10 ms
impacts = all
strike_window = 1 ms
"""
TEXTS = {
    "program": "soft",
    "version": "3.8",
    "command": "soft -in mill",
    "started": "2026-01-31T12:00:00Z",
    "notes": "soft balls",
}


def record(kind, *parts):
    data = b"".join(parts)
    return struct.pack("<8sQ", kind.ljust(8).encode(), len(data)) + data


def begin(balls=N, kinds=5, motions=1, apart=1e-3, springs=0):
    return record("begin", struct.pack("<3QdQ", balls, kinds, motions, apart, springs))


def fact(name, value, unit=""):
    kind, data = ("text", value.encode()) if isinstance(value, str) else ("f8", struct.pack("<d", value))  # fmt: skip
    return record("fact", b"\0".join(word.encode() for word in (name, unit, "said", kind, "")), data)


def facts(**other):
    return b"".join(fact(name, value) for name, value in {**TEXTS, "wall_time": 2.0, "cpu_time": 3.0, **other}.items())


PLACES = np.array([[0.01, 0, 0.02], [-0.01, 0, 0.02], [0.01, 0, -0.02], [-0.01, 0, -0.02]])


def state(when, place=PLACES, velocity=0.5):
    values = [place, np.full((N, 3), velocity), np.zeros((N, 3))]
    return record("state", struct.pack("<d", when), *(np.asarray(v, "<f8").tobytes() for v in values))  # fmt: skip


def impact(when, kind=0, ball=0, partner=1, speed=1.0, slip=0.5, lost=1e-3, at=(0, 0, 0.02)):
    return struct.pack("<10d4i", when, speed, slip, lost, *at, 0, 0, 1, kind, ball, partner, 0)


def impacts(*rows):
    return record("impacts", *rows)


def account(when, work=0.0, impulse=0.0, lost=(0.0,) * 10, elastic=math.nan):
    return record("account", struct.pack("<14d", when, elastic, work, impulse, *lost))


def end(when=0.2, how="complete"):
    return record("end", struct.pack("<d", when), how.encode())


def springs(interval=1e-5, shear=(2 / 7, 1.0), stiffness=1e5, dashpot=1.0):
    return record("springs", struct.pack("<13d", interval, *shear, *(stiffness, dashpot) * 5))


STILL = (0.0,) * 6 + (1.0, 0, 0, 0, 1, 0, 0, 0, 1)


def sample(when, place=PLACES, velocity=(0.0, 0, 0), number=(1, 2, 3, 4), keep=0, frame=STILL):
    rows = np.column_stack([number, place, np.tile(velocity, (N, 1)), np.zeros((N, 3))])
    return record("sample", struct.pack("<17d", when, keep, *frame), np.asarray(rows, "<f8").tobytes())


HEAD = MAGIC + begin() + facts()


def states(last=0.2):
    """At all times that the observers ask for: a millisecond apart, at halves and wholes."""
    return b"".join(state(k * 0.5e-3) for k in range(round(last / 0.5e-3) + 1))


def accounts(last=0.2):
    return b"".join(account(k * 0.01) for k in range(round(last / 0.01) + 1))


@pytest.fixture
def digest(write_deck, tmp_path):
    """digest(stream, *options): how millsim ends, and what it says."""
    write_deck(DECK)

    def run(stream, *options):
        words = [PROGRAM, "--digest", "-o", "out.h5", *options, "deck.ini"]
        done = subprocess.run(words, input=stream, capture_output=True, cwd=tmp_path, timeout=60)
        done.said = done.stderr.decode().removeprefix("millsim: ").rstrip("\n")
        return done

    return run


@pytest.fixture
def made(digest, tmp_path):
    """made(stream): the file of a stream in which all is right."""

    def run(stream):
        done = digest(stream)
        assert (done.returncode, done.said) == (0, "")
        return h5py.File(tmp_path / "out.h5")

    return run


# ---- what the observers make of it


def test_a_sample_sees_the_impacts_before_its_time_and_none_at_it(made):
    rows = [impact(t) for t in (0.0, 0.1, 0.1, 0.15)]
    with made(HEAD + states() + account(0.0) + impacts(*rows) + account(0.2) + end()) as file:
        counts = file["observables/collisions/ball_ball/value"][:]
        fast = file["observables/fast_collisions/ball_ball/value"][:]
        assert file["observables/collisions/ball_ball/time"][10] == 0.1
        assert counts[[0, 1, 10, 11, 15, 16, 20]].tolist() == [0, 1, 1, 3, 3, 4, 4]
        assert fast[20].tolist() == [4, 4, 0]
        assert file["impacts/time"][:].tolist() == [0.0, 0.1, 0.1, 0.15]
        assert file["impacts/dissipation"].attrs["part"] == "normal"


def test_an_impact_at_the_windows_begin_is_in_and_one_at_its_end_is_out(made):
    times = [np.nextafter(0.02, 0), 0.02, 0.1, np.nextafter(0.2, 0), 0.2]
    rows = [impact(t) for t in times]
    with made(HEAD + states() + account(0.0) + impacts(*rows) + account(0.2) + end()) as file:
        assert file["statistics/impacts/all/count"][()] == 3
        assert file["statistics/maps/axial/impact_count"][:].sum() == 3
        # 0.02 s: of a strike that began before
        assert file["statistics/strikes/all/count"][()] == 2
        assert file["run/events/collisions/ball_ball"][()] == 4
        assert file["run/time"][()] == 0.2
        assert file["statistics/duration"][()] == pytest.approx(0.18)


def test_works_and_losses_are_linear_between_accounts(made):
    """A turn takes 50 ms and a batch a twelfth of it, so batches end between accounts."""
    lost = (4e-3, 3e-3) + (0.0,) * 8
    rows = (account(0.0), account(0.01), account(0.19, 3.6, -0.018, lost), account(0.2, 3.8, -0.019, lost))  # fmt: skip
    with made(HEAD + states() + b"".join(rows) + end()) as file:
        rotor = file["statistics/rotor"]
        assert rotor["power"][()] == pytest.approx((3.8 - 0.2) / 0.18)
        assert file["statistics/impacts/all/dissipated_power"][()] == pytest.approx(4e-3 * 17 / 18 / 0.18)  # fmt: skip
        assert file["observables/rotor_work/value"][2] == pytest.approx(0.2)
        assert file["observables/rotor_torque/value"][2] == pytest.approx(-0.1)
        normal = file["observables/dissipation_normal/ball_ball/value"]
        assert normal[10] == pytest.approx(3e-3 / 2)


def test_what_an_account_does_not_tell_is_unknown_not_zero(made):
    nothing = (math.nan,) * 12
    rows = (account(t, *nothing[:2], nothing[2:], elastic=5 * t) for t in (0.0, 0.1, 0.2))
    head = MAGIC + begin(springs=1) + facts()
    with made(head + states() + b"".join(rows) + end()) as file:
        assert np.isnan(file["observables/rotor_work/value"][:]).all()
        for name in (
            "rotor/power", "drive/power", "drive/pinch_power", "impacts/all/dissipated_power", "floor_share/all",
        ):  # fmt: skip
            assert np.isnan(file[f"statistics/{name}"][()]), name
        elastic = file["observables/elastic_energy"]
        assert np.allclose(elastic["value"][:], 5 * elastic["time"][:])
        assert elastic["time"] == file["observables/kinetic_energy/time"]


def test_balls_fly_freely_from_the_nearest_state(made):
    """States every 3 ms and a bit: frames are at their own times all the same."""
    step, g = 3.1e-3, np.array([0, 0, -9.81])
    rows = b"".join(state(k * step, PLACES + 0.5 * k * step) for k in range(66))
    head = MAGIC + begin(apart=step / 2) + facts()
    with made(head + rows + accounts() + end()) as file:
        frames = file["particles/trajectory/position"]
        assert frames["time"][:].tolist() == [0.0, 0.05, 0.1, 0.15000000000000002, 0.2]
        for k, when in enumerate(frames["time"][:]):
            fall = when - step * np.round(when / step)
            assert np.allclose(frames["value"][k], PLACES + 0.5 * when + g * fall**2 / 2, atol=1e-8)
        kinetic = file["observables/kinetic_energy/value"][0]
        mass = file["particles/trajectory/mass"][:].sum()
        assert kinetic == pytest.approx(mass * 0.75 / 2)


def test_the_file_says_whose_run_it_is(made):
    with made(
        HEAD + fact("measured/ball_ball/restitution", 0.79, "1") + states() + account(0.0) + account(0.2) + end()
    ) as file:
        run = file["run"]
        for name in ("program", "version", "command", "started"):
            assert run[name].asstr()[()] == TEXTS[name]
        assert run["status"].asstr()[()] == "complete"
        assert run["wall_time"][()] == 2.0
        restitution = run["measured/ball_ball/restitution"]
        assert restitution[()] == 0.79 and restitution.attrs["unit"] == "1"
        creator = file["h5md/creator"].attrs
        assert (creator["name"], creator["version"]) == ("soft", "3.8")
        notes = run["notes"].asstr()[()].splitlines()
        assert notes[0] == "soft balls"
        assert "reach" not in run and "checkpoint" not in file
        assert "VTKHDF" in file and "[run]" in file["deck/text"].asstr()[()]


def test_results_so_far_are_there_while_the_stream_goes_on(write_deck, tmp_path):
    write_deck(DECK)
    out = tmp_path / "out.h5"
    words = [PROGRAM, "--digest", "-o", out, "deck.ini"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, cwd=tmp_path) as engine:
        engine.stdin.write(HEAD + states(0.1) + account(0.0) + impacts(impact(0.05)) + account(0.1) + record("publish"))
        engine.stdin.flush()
        deadline = time.monotonic() + 20
        while not out.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        with h5py.File(out) as file:
            assert file["run/status"].asstr()[()] == "running"
            assert file["run/time"][()] == 0.1
            assert file["statistics/duration"][()] == pytest.approx(0.08)
            assert file["statistics/impacts/all/count"][()] == 1
            assert "VTKHDF" not in file
        engine.stdin.write(fact("wall_time", 9.0) + b"".join(state(0.1 + k * 1e-3 / 2) for k in range(1, 201)))
        engine.stdin.write(impacts(impact(0.15)) + account(0.2) + end())
    assert engine.returncode == 0
    with h5py.File(out) as file:
        assert file["run/status"].asstr()[()] == "complete"
        assert file["run/wall_time"][()] == 9.0
        assert file["statistics/impacts/all/count"][()] == 2
        assert file["observables/rotor_work/value"].shape == (21,)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["deck.ini", "out.h5"]


def test_from_the_last_account_to_the_end_works_go_on(made):
    stream = HEAD + states() + account(0.0) + account(0.18) + account(0.19, 1.0)
    with made(stream + impacts(impact(0.195), impact(0.197)) + end(0.196)) as file:
        assert file["run/time"][()] == 0.196
        assert file["statistics/impacts/all/count"][()] == 1
        assert file["statistics/rotor/power"][()] == pytest.approx(1.6 / 0.176)


# ---- what cannot be


@pytest.mark.parametrize(
    "stream, line",
    [
        (b"", "is not a stream of a run: expected the line 'millsim stream 1' first (docs/file-format.md)"),
        (b"millsim stream 2\n" + begin(),
         "is not a stream of a run: expected the line 'millsim stream 1' first (docs/file-format.md)"),
        (MAGIC + facts(), "record 1 (fact): expected the record 'begin' first"),
        (MAGIC + begin(balls=5), "record 1 (begin): it is of a mill with 5 balls, and the deck has 4"),
        (MAGIC + begin(kinds=6), "record 1 (begin): it is of a mill with 6 kinds of contact, and the deck has 5"),
        (MAGIC + begin(motions=0), "record 1 (begin): it is of a mill with 0 motions, and the deck has 1"),
        (MAGIC + begin(apart=math.nan), "record 1 (begin): expected a time of 0 s or more, and 0 or 1 for springs"),
        (MAGIC + begin() + begin(), "record 2 (begin): a second record of this type"),
        (MAGIC + begin() + state(0.0), "record 2 (state): the fact 'program' (text) must come before it"),
        (MAGIC + begin() + facts(cpu_time="3") + state(0.0),
         "record 9 (state): the fact 'cpu_time' (f8, in s) must come before it"),
        (HEAD + fact("status", "complete"),
         "record 9 (fact): 'status': expected the name of a value of /run that millsim does not write itself, "
         "unit, meaning, type (f8, u8 or text) and value"),
        (HEAD + fact("../x", 1.0),
         "record 9 (fact): '../x': expected the name of a value of /run that millsim does not write itself, "
         "unit, meaning, type (f8, u8 or text) and value"),
        (HEAD + record("fact", b"a\0b\0c"), "record 9 (fact): 5 bytes: expected 6 or some more"),
        (HEAD + record("fact", b"a\0b\0c\0f8\0" + bytes(7)),
         "record 9 (fact): 'a': expected the name of a value of /run that millsim does not write itself, "
         "unit, meaning, type (f8, u8 or text) and value"),
        (HEAD + record("stat\x1be", b""), "record 9 (stat?e): unknown record"),
        (HEAD + record("state", bytes(8)), "record 9 (state): 8 bytes: expected 296"),
        (HEAD + struct.pack("<8sQ", b"impacts ", 1 << 62),
         "record 9 (impacts): 4611686018427387904 bytes: expected 96 for each impact, 2^20 impacts at most"),
    ],
    ids=range(17),
)  # fmt: skip
def test_a_stream_that_is_wrong_from_the_start_writes_nothing(digest, tmp_path, stream, line):
    done = digest(stream)
    assert (done.returncode, done.said) == (2, f"standard input: {line}")
    assert [path.name for path in tmp_path.iterdir()] == ["deck.ini"]


BAD = np.array(PLACES)
BAD[2, 1] = math.nan
GOOD = HEAD + states(0.1) + account(0.0) + impacts(impact(0.05)) + account(0.1)
KEPT = "; out.h5 holds the run up to 0.1 s"


@pytest.mark.parametrize(
    "more, line",
    [
        (state(0.2, BAD), "record 213 (state): ball 2: its place: got nan"),
        (state(0.2, velocity=math.inf), "record 213 (state): ball 0: its velocity: got inf"),
        (impacts(impact(0.11, at=(0, 1e6, 0))), "record 213 (impacts): impact 0: at 0 1e+06 0 m: is that in the mill?"),
        (state(0.05), "record 213 (state): its time is 0.05 s, that of the one before 0.1"),
        (state(math.inf), "record 213 (state): its time is inf s, that of the one before 0.1"),
        (impacts(impact(0.11), impact(0.12, kind=5)), "record 213 (impacts): impact 1: kind 5, expected 0 to 4"),
        (impacts(impact(0.11, kind=-1)), "record 213 (impacts): impact 0: kind -1, expected 0 to 4"),
        (impacts(impact(0.11, ball=4)), "record 213 (impacts): impact 0: ball 4 and partner 1, expected 0 to 3"),
        (impacts(impact(0.11, partner=-1)), "record 213 (impacts): impact 0: ball 0 and partner -1, expected 0 to 3"),
        (impacts(impact(0.11, partner=0)), "record 213 (impacts): impact 0: ball 0 and partner 0"),
        (impacts(impact(0.11, kind=1, partner=-2)), "record 213 (impacts): impact 0: ball 0 and partner -2"),
        (impacts(impact(0.11, speed=math.nan)), "record 213 (impacts): impact 0: expected numbers"),
        (impacts(impact(math.nan)), "record 213 (impacts): impact 0: expected numbers"),
        (impacts(impact(0.12), impact(0.11)),
         "record 213 (impacts): impact 1: its time is 0.11 s, after an impact or account of 0.12 s"),
        (impacts(impact(0.09)),
         "record 213 (impacts): impact 0: its time is 0.09 s, after an impact or account of 0.1 s"),
        (account(0.09), "record 213 (account): its time is 0.09 s, that of the one before 0.1"),
        (account(0.11, math.inf), "record 213 (account): expected finite numbers, or NaN for what is not known"),
        (account(0.12),
         "record 213 (account): there is no state of the balls within 0.001 s of t = 0.1015 s, where statistics want "
         "one"),
        (end(0.09), "record 213 (end): its time is 0.09 s, that of the last account 0.1"),
        (end(how="finished"), "record 213 (end): expected complete, stopped or failed"),
        (b"", "ends without the record 'end', after 212 records"),
        (b"state  ", "is cut off in record 213: expected more bytes"),
        (account(0.11)[:-1], "is cut off in record 213: expected more bytes"),
    ],
    ids=range(23),
)  # fmt: skip
def test_a_stream_that_goes_wrong_midway_leaves_what_it_has_told(digest, tmp_path, more, line):
    done = digest(GOOD + more)
    assert done.returncode == 1
    if "no state" in line:  # it got as far as there are states
        assert done.said.startswith(f"standard input: {line}; out.h5 holds the run up to 0.1")
    else:
        assert done.said == f"standard input: {line}{KEPT}"
    with h5py.File(tmp_path / "out.h5") as file:
        assert file["run/status"].asstr()[()] == "failed"
        assert file["statistics/impacts/all/count"][()] == 1
        assert file["statistics/duration"][()] == pytest.approx(0.08)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["deck.ini", "out.h5"]


def test_a_stream_that_ends_before_its_first_account_leaves_no_file(digest, tmp_path):
    done = digest(HEAD + states(0.1))
    assert (done.returncode, done.said) == (1, "standard input: ends without the record 'end', after 209 records")
    assert [path.name for path in tmp_path.iterdir()] == ["deck.ini"]


def test_a_complete_run_has_an_account(digest, tmp_path):
    done = digest(HEAD + end(0.0))
    assert done.returncode == 1 and "(end): expected an account before" in done.said


def test_a_run_that_stopped_before_anything_happened_has_a_file_that_says_so(made):
    with made(HEAD + end(0.0, "stopped")) as file:
        assert file["run/status"].asstr()[()] == "stopped"
        assert file["statistics/duration"][()] == 0
        assert file["statistics/impacts/all/rate"][()] == 0
        assert np.isnan(file["statistics/impacts/all/normal_speed/median"][()])
        assert file["observables/rotor_work/value"].shape == (0,)


def test_an_older_file_is_not_overwritten_unasked(digest, tmp_path):
    (tmp_path / "out.h5").write_bytes(b"mine")
    done = digest(GOOD + states()[0:0] + end(0.1))
    assert done.returncode == 2
    assert done.said == "out.h5: exists already; --force overwrites it, -o gives another name"
    assert (tmp_path / "out.h5").read_bytes() == b"mine"
    done = digest(b"nothing", "--force")
    assert (done.returncode, (tmp_path / "out.h5").read_bytes()) == (2, b"mine")
    assert digest(GOOD + end(0.1), "--force").returncode == 0
    assert h5py.is_hdf5(tmp_path / "out.h5")


# ---- samples of soft spheres


WRONG = "expected finite numbers, and each ball from 1 to 4 once"
SPRINGS = "expected an interval and springs above 0, dashpots of 0 or more, and damped 0 or 1"
SKEWED = (0.0,) * 6 + (1.0, 0, 0, 1, 0, 0, 0, 0, 1)


@pytest.mark.parametrize(
    "more, line",
    [
        (springs(interval=0), f"1 (springs): {SPRINGS}"),
        (springs(stiffness=-1), f"1 (springs): {SPRINGS}"),
        (springs(dashpot=math.inf), f"1 (springs): {SPRINGS}"),
        (springs(shear=(2 / 7, 0.5)), f"1 (springs): {SPRINGS}"),
        (springs() + sample(0.15, frame=SKEWED), "2 (sample): expected directions x, y, z of the frame with length 1"),
        (record("springs", bytes(96)), "1 (springs): 96 bytes: expected 104"),
        (sample(0.15), "1 (sample): expected the record 'springs' before"),
        (record("part"), "1 (part): expected samples before"),
        (record("ask"), "1 (ask): expected samples before"),
        (springs() + sample(math.nan), "2 (sample): expected numbers"),
        (springs() + sample(0.15, frame=(math.inf, *STILL[1:])), "2 (sample): expected numbers"),
        (springs() + sample(0.15) + sample(0.14), "3 (sample): its time is 0.14 s, that of the last one 0.15"),
        (springs() + sample(0.15, BAD), f"2 (sample): row 2: {WRONG}"),
        (springs() + sample(0.15, number=(1, 2, 5, 4)), f"2 (sample): row 2: {WRONG}"),
        (springs() + sample(0.15, number=(0, 2, 3, 4)), f"2 (sample): row 0: {WRONG}"),
        (springs() + sample(0.15, number=(1, 2, 3, 2)), f"2 (sample): row 3: {WRONG}"),
    ],
    ids=range(16),
)  # fmt: skip
def test_a_sample_that_cannot_be_is_one_line(digest, tmp_path, more, line):
    done = digest(GOOD + more)
    assert done.returncode == 1
    number, _, why = line.partition(" ")
    said = f"standard input: record {212 + int(number)} {why}"
    assert done.said.startswith(said) and done.said.endswith(KEPT)
    with h5py.File(tmp_path / "out.h5") as file:
        assert file["run/status"].asstr()[()] == "failed"


def test_a_frame_that_moves_changes_nothing(digest, tmp_path):
    """Two balls that meet, told from a frame that flies past, on its side."""
    turned, past = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.array([3.0, -2, 1])
    seen = []
    for moving in (False, True):
        stream, velocity = HEAD + springs() + sample(0.0, keep=1) + account(0.0), np.zeros((N, 3))
        velocity[0], place = [-1.0, 0, 0], PLACES + [[-0.0049, 0, 0], [0.01, 0, 0], [0, 0, 0], [0, 0, 0]]
        for k in range(20):
            when, at = 1e-5 * (1 + k), place + 1e-5 * k * velocity
            frame, told, moves = STILL, at, velocity
            if moving:
                origin = past * when
                frame = (*origin, *past, *turned.ravel())
                told, moves = (at - origin) @ turned.T, (velocity - past) @ turned.T
            rows = np.column_stack([[1, 2, 3, 4], told, moves, np.zeros((N, 3))])
            stream += record("sample", struct.pack("<17d", when, 0, *frame), np.asarray(rows, "<f8").tobytes())
        done = digest(stream + record("ask") + states()[len(state(0.0)) :] + account(0.2) + end(), "-f", "-q")
        assert done.returncode == 0, done.said
        with h5py.File(tmp_path / "out.h5") as file:
            log = [file[f"impacts/{name}"][:] for name in ("time", "normal_speed", "ball", "partner", "position")]
        seen.append((np.frombuffer(done.stdout), log))
    assert len(seen[0][1][0]) == 1 and seen[0][1][1] == pytest.approx([1.0], rel=0.1)
    assert len(seen[0][0]) == 2 + 1 + 3 * 5 + 9 * N
    assert seen[1][0] == pytest.approx(seen[0][0], abs=1e-11)
    for mine, other in zip(*(log[:4] for _, log in seen), strict=True):
        assert mine == pytest.approx(other, rel=1e-6, abs=1e-9)
    # between the impact and its sample, the place of the impact goes with the frame
    assert seen[1][1][4] == pytest.approx(seen[0][1][4], abs=1e-5 * np.linalg.norm(past))


@pytest.mark.parametrize("option", ["--check", "--resume", "--json", "--paranoid"])
def test_options_of_runs_are_refused(digest, option):
    done = digest(b"", option)
    assert done.returncode == 2
    assert done.said == (
        f"options '--digest' and '{option}' exclude each other: --digest runs nothing; another program has run the deck"
    )


def test_a_signal_ends_it_with_what_it_has_been_told(write_deck, tmp_path):
    write_deck(DECK)
    words = [PROGRAM, "--digest", "-o", "out.h5", "deck.ini"]
    engine = subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path)
    engine.stdin.write(GOOD + record("publish"))
    engine.stdin.flush()
    while not (tmp_path / "out.h5").exists():
        time.sleep(0.01)
    engine.send_signal(signal.SIGTERM)
    assert engine.wait(20) == 128 + signal.SIGTERM  # though its input is still open
    assert engine.stderr.read() == b"millsim: stopped by signal 15; out.h5 holds the run up to 0.1 s\n"
    engine.stdin.close()
    with h5py.File(tmp_path / "out.h5") as file:
        assert file["run/status"].asstr()[()] == "stopped"
        assert "stopped at 0.1 s of 0.2 s" in file["run/notes"].asstr()[()]
