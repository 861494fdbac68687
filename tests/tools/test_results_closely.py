"""Results of another program, looked at closely: batches, results so far, borders, the file, what is refused."""

import os

import h5py
import numpy as np
import pytest
from foreign import MIXTURE, ORDER, RUN, batch, cost, deck_of, feed, random_batches, simulate, start

from milltools import h5write
from milltools.results import Results


@pytest.fixture(scope="module")
def mill(tmp_path_factory):
    """(deck, millsim's file) of the mixture without friction, which pinches no balls."""
    return simulate(tmp_path_factory.mktemp("mill"), MIXTURE.replace("friction = 0.3", ""))


def test_batches_change_nothing(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        n = len(theirs["impacts/time"])
        contents = []
        for name, batches in (("one.h5", []), ("many.h5", range(1, n, 97))):
            results = start(deck, theirs)
            feed(results, theirs, batches)
            results.write(tmp_path / name, RUN)
            contents.append((tmp_path / name).read_bytes())
    assert contents[0] == contents[1]


def test_a_batch_of_millions_is_worked_on_slice_by_slice(mill, tmp_path, monkeypatch):
    deck, path = mill
    monkeypatch.setattr("milltools.results.SLICE", 1000)
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
        feed(results, theirs, [])
        results.write(tmp_path / "ours.h5", RUN)
        with h5py.File(tmp_path / "ours.h5") as ours:
            for name in ("impacts/all", "strikes/ball_blade"):
                name = f"statistics/{name}/normal_speed/histogram/dissipation"
                assert np.array_equal(ours[name], theirs[name])


def test_arrays_may_be_used_again_after_they_were_handed_over(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
        columns = [theirs["impacts"][name][:100] for name in ORDER]
        results.impacts(*columns)
        for column in columns:
            column[:] = 0
        results.write(tmp_path / "ours.h5", RUN)
        with h5py.File(tmp_path / "ours.h5") as ours:
            assert all(np.array_equal(ours["impacts"][name], theirs["impacts"][name][:100]) for name in ORDER)  # fmt: skip


def test_results_so_far_cover_the_time_so_far(mill, tmp_path):
    deck, path = mill
    until = 0.13  # two whole blocks of 50 ms
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
        feed(results, theirs, [], until)
        results.write(tmp_path / "ours.h5", RUN, status="running", time=until)
        times = theirs["impacts/time"][:]
        inside = np.sum((times >= 0.02) & (times < until))
        blocks = theirs["statistics/rotor/block_power"][:2]
        with h5py.File(tmp_path / "ours.h5") as ours:
            assert ours["run/status"].asstr()[()] == "running"
            assert ours["run/time"][()] == until
            assert ours["statistics/duration"][()] == until - 0.02
            assert ours["statistics/impacts/all/count"][()] == inside
            assert ours["observables/rotor_work/value"].shape == (131,)
            assert ours["particles/trajectory/velocity/value"].shape[0] == 261
            assert ours["statistics/maps/samples"][()] == 110
            rotor = ours["statistics/rotor"]
            assert np.allclose(rotor["block_power"][:], blocks, rtol=1e-9)
            work = theirs["observables/rotor_work/value"][:]
            assert rotor["power"][()] == pytest.approx((work[130] - work[20]) / 0.11, rel=1e-9)


def test_a_run_that_goes_on_after_writing_ends_like_one_that_was_not_written(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        for name, early in (("a.h5", False), ("b.h5", True)):
            results = start(deck, theirs)
            if early:
                results.write(tmp_path / name, RUN, status="running", time=0.0)
                with h5py.File(tmp_path / name) as so_far:
                    assert np.isnan(so_far["statistics/rotor/power"][()])
                    assert so_far["statistics/duration"][()] == 0
                    assert so_far["statistics/impacts/all/rate"][()] == 0
                    assert so_far["statistics/impacts/all/dissipated_power"][()] == 0
                    assert so_far["observables/rotor_work/value"].shape == (0,)
            feed(results, theirs, random_batches(1000, 5))
            results.write(tmp_path / name, RUN)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_what_a_row_does_not_give_is_unknown_not_zero(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
    for time in (0.0, 0.1, 0.2):
        results.row(time, {"kinetic_energy": 1.0, "elastic_energy": 2 * time})
    results.write(tmp_path / "ours.h5", RUN)
    with h5py.File(tmp_path / "ours.h5") as ours:
        assert np.isnan(ours["observables/rotor_work/value"][:]).all()
        assert np.isnan(ours["statistics/rotor/power"][()])
        assert np.isnan(ours["statistics/impacts/all/dissipated_power"][()])
        elastic = ours["observables/elastic_energy"]
        assert elastic["value"][:].tolist() == [0, 0.2, 0.4] and elastic["value"].attrs["unit"] == "J"
        assert elastic["time"] == ours["observables/kinetic_energy/time"]


def test_a_million_impacts_cost_less_than_one_and_a_half_seconds(idle):
    idle.log_wanted = False
    generator = np.random.default_rng(1)
    n = 1_000_000
    kind, ball, partner = generator.integers(0, [[5], [300], [300]], (3, n))
    speeds, point = generator.gamma(2, 0.3, (3, n)), generator.uniform(-0.04, 0.04, (n, 3))
    begin = iter((0.03, 0.06, 0.09))

    def hand_over():
        times = next(begin) + np.linspace(0, 0.03, n)
        idle.impacts(times, kind, ball, partner, point, point, *speeds)

    assert cost(hand_over) < 1.5


# ---- the file ----


def test_an_older_file_stands_when_a_new_one_cannot_be_made(tmp_path, monkeypatch):
    path = tmp_path / "mill.h5"
    path.write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"mill.h5: cannot write: .*No space left") as raised:
        with h5write.whole_file(path) as file:
            file["x"] = 1
    assert "\n" not in str(raised.value)
    assert path.read_bytes() == b"old" and os.listdir(tmp_path) == ["mill.h5"]


def test_a_file_is_replaced_as_a_whole_and_a_link_stays_a_link(tmp_path):
    (tmp_path / "there").mkdir()
    target, link = tmp_path / "there" / "mill.h5", tmp_path / "mill.h5"
    link.symlink_to(target)
    with h5write.whole_file(link) as file:
        file["x"] = 1
        assert not target.exists()
    with h5py.File(target) as old, h5write.whole_file(link) as file:
        file["x"] = 2
        assert old["x"][()] == 1
    with h5py.File(link) as new:
        assert link.is_symlink() and new["x"][()] == 2
    assert os.listdir(target.parent) == ["mill.h5"]


def test_nothing_is_left_among_the_temporary_files(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        columns = (theirs["particles/trajectory"][name][:] for name in ("diameter", "mass", "species"))  # fmt: skip
        results = Results(deck, *columns, ["big", "little"], folder=tmp_path)
        feed(results, theirs, [])
    assert os.listdir(tmp_path) == []


# ---- borders ----


@pytest.fixture
def idle(mill):
    """Results of the mixture, nothing delivered yet."""
    deck, path = mill
    with h5py.File(path) as theirs:
        return start(deck, theirs)


def test_an_impact_at_a_rows_time_counts_from_the_next_row_on(idle, tmp_path):
    idle.impacts(*batch([0.0, 0.1, 0.1, 0.15]))
    for time in (0.0, 0.1, 0.2):
        idle.row(time, {})
    idle.write(tmp_path / "ours.h5", RUN)
    with h5py.File(tmp_path / "ours.h5") as ours:
        for name, value in (("collisions", [0, 1, 4]), ("fast_collisions", [[0] * 3, [1, 1, 0], [4, 4, 0]])):  # fmt: skip
            assert ours[f"observables/{name}/ball_ball/value"][:].tolist() == value


def test_an_impact_at_the_windows_begin_is_in_and_one_at_its_end_is_out(idle, tmp_path):
    before, end = np.nextafter(0.02, 0), 0.2
    idle.impacts(*batch([before, 0.02, 0.1, np.nextafter(end, 0), end, 0.3]))
    idle.write(tmp_path / "ours.h5", RUN)
    with h5py.File(tmp_path / "ours.h5") as ours:
        assert ours["statistics/impacts/all/count"][()] == 3
        assert ours["statistics/maps/axial/impact_count"][:].sum() == 3
        assert ours["statistics/strikes/all/count"][()] == 2  # 0.02 s: of a strike that began before
        assert ours["run/events/collisions/ball_ball"][()] == 6


# ---- what cannot be ----


def test_impacts_out_of_order_are_refused(idle):
    idle.impacts(*batch([0.1, 0.1, 0.2]))
    for times in ([0.3, 0.25], [0.19], [np.nan]):
        with pytest.raises(ValueError, match="order of time"):
            idle.impacts(*batch(times))
    idle.impacts(*batch([0.2]))


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda r: r.impacts(*batch([0.1], kind=np.array([5]))), r"kind is none of 0\.\.4"),
        (lambda r: r.impacts(*batch([0.1], point=np.zeros(3))), r"position.* shape \(3,\)"),
        (lambda r: r.row(0.0, {"rotor_wrok": 1}), "rotor_wrok: no time series"),
        (lambda r: r.row(0.0, {"collisions/ball_ball": 1}), "is counted"),
        (lambda r: r.snapshot(np.zeros((4, 3)), np.zeros((4, 3))), r"expected an array \(300, 3\)"),
        (lambda r: r.snapshot(np.full((300, 3), np.nan), np.zeros((300, 3))), "no number"),
        (lambda r: r.frame(0.0, *[np.zeros((300, 2))] * 3), r"position: expected an array \(300, 3\)"),
        (lambda r: r.write("x.h5", RUN, status="done"), "'done' is none of complete"),
        (lambda r: r.write("x.h5", {}), "run: program is missing"),
        (lambda r: r.write("x.h5", {**RUN, "dt": 1e-6}), r"run: dt: expected \(value, unit"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_one_line(idle, tmp_path, monkeypatch, call, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message) as raised:
        call(idle)
    assert "\n" not in str(raised.value)
    assert os.listdir(tmp_path) == []


def test_there_are_no_more_snapshots_than_planned(idle):
    balls = np.zeros((300, 3))
    assert len(idle.snapshot_times) == 180
    assert np.allclose(idle.snapshot_times, 0.02 + (np.arange(180) + 0.5) * 1e-3, atol=1e-12)
    for _ in idle.snapshot_times:
        idle.snapshot(balls, balls)
    with pytest.raises(ValueError, match="only 180"):
        idle.snapshot(balls, balls)


def test_frames_are_refused_where_the_deck_wants_none(mill):
    deck, path = mill
    deck = deck_of(deck.text.replace("frames = 0.0005 s", "frames = 0 s"))
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
    with pytest.raises(ValueError, match="output.frames is 0 s"):
        results.frame(0.0, *[np.zeros((300, 3))] * 3)


def test_a_file_name_in_quotes_is_one_value():
    from milltools.read.schema import deck_entries

    text = '[balls]\nstart = "a # b.txt"   # random, or a file\nspeed = 0 m/s  # of every ball # at t = 0\n'
    assert list(deck_entries(text)) == [
        ("balls", "start", '"a # b.txt"', "random, or a file"),
        ("balls", "speed", "0 m/s", "of every ball # at t = 0"),
    ]
