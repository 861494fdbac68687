"""The reader of the output file: what it returns is what the deck says and h5py reads; what is wrong is one line."""

import h5py
import numpy as np
import pytest
from conftest import SMALL

from milltools.base.errors import UserError
from milltools.read.deck_text import entries
from milltools.read.kinds import KINDS
from milltools.read.runfile import Run

PADDLE = """
[blade.paddle]
position = 10 mm
angle = 90 deg
tip_radius = 20 mm
width = 6 mm
thickness = 3 mm
pitch = 30 deg
"""


@pytest.fixture
def finished(millsim, write_deck, tmp_path):
    write_deck(SMALL + PADDLE)
    done = millsim("deck.ini", "-q", "-s", "run.sample_from=10 ms")
    assert done.returncode == 0, done.stderr
    return tmp_path / "deck.h5"


def test_values_of_the_deck_are_in_si(finished):
    with Run(finished) as run:
        assert run.quantity("drum/radius") == 0.03
        assert run.rotor_speed == pytest.approx(600 * 2 * np.pi / 60, rel=1e-15)
        assert list(run.vector("gravity/acceleration")) == [0, 0, -9.81]
        assert run.text("drum/profile") == "circle"
        assert run.quantity("blade.paddle/pitch") == pytest.approx(np.pi / 6, rel=1e-15)
        assert run.quantity("drum/buckles", 0.0) == 0.0
        assert run.deck()["contact.restitution"] == "0.8"


def test_blades_are_numbered_as_in_the_file(finished):
    with Run(finished) as run:
        two, _, paddle = blades = run.as_deck.blades
    assert len(blades) == 3
    assert [b.position for b in blades] == pytest.approx([-0.01, 0.01, 0.01])
    assert [b.angle for b in blades] == pytest.approx([0, np.pi, np.pi / 2])
    assert (two.tip_radius, two.width, two.thickness, two.pitch) == (0.022, 0.006, 0.004, 0)
    assert (paddle.tip_radius, paddle.width, paddle.thickness) == (0.02, 0.006, 0.003)


def test_a_finished_run_of_millsim_says_so(finished):
    with Run(finished) as run:
        assert (run.program, run.status, run.time) == ("millsim", "complete", 0.05)
        assert run.window == pytest.approx((0.01, 0.05))


def test_series_are_those_stored(finished):
    with Run(finished) as run, h5py.File(finished) as file:
        time, value = run.series("collisions/ball_drum")
        assert value.dtype == float
        assert np.array_equal(value, file["observables/collisions/ball_drum/value"])
        assert time[-1] == 0.05


def test_impacts_above_an_edge_are_counted_exactly(millsim, write_deck, tmp_path):
    write_deck(SMALL)
    assert millsim("deck.ini", "-q", "-s", "output.impacts=all").returncode == 0
    with Run(tmp_path / "deck.h5") as run:
        speed, kind = run.read("impacts/normal_speed"), run.read("impacts/kind")
        for number, name in enumerate(KINDS):
            for edge in (0.05, 1.0, 20.0, 1e9):
                assert run.histogram(name).above(edge) == np.sum(speed[kind == number] >= edge)
        everything = run.histogram("all")
        between = everything.above(0.505)
        assert everything.above(0.52) <= between <= everything.above(0.49)


def spoil(path, how):
    with h5py.File(path, "r+") as file:
        how(file)


@pytest.mark.parametrize(
    "how, use, words",
    [
        (lambda f: f.pop("deck"), lambda r: r.program, "this HDF5 file is not a run"),
        (lambda f: f.pop("statistics"), lambda r: r.need_statistics(), "no statistics yet"),
        (lambda f: f.pop("statistics/maps"), lambda r: r.map("samples"), "has no /statistics/maps"),
        (lambda f: f.pop("deck/drum/radius"), lambda r: r.quantity("drum/radius"), "has no /deck/drum/radius"),
        (lambda f: f.pop("particles"), lambda r: r.frame(0), "output.frames = 0 s"),
        (lambda f: f.__setitem__("statistics/duration", 0.0), lambda r: r.need_statistics(), "nothing sampled"),
    ],
    ids=["no deck", "unfinished", "no maps", "no key", "no frames", "too short"],
)  # fmt: skip
def test_what_is_missing_is_named(finished, how, use, words):
    def apply(file):
        if words == "nothing sampled":
            del file["statistics/duration"]
        how(file)

    spoil(finished, apply)
    with pytest.raises(UserError, match=words) as fault, Run(finished) as run:
        use(run)
    assert str(fault.value).startswith(f"{finished}: ")
    assert fault.value.status == 2


def test_a_file_that_is_no_hdf5_is_named(tmp_path):
    (tmp_path / "foreign.h5").write_text("no HDF5")
    with pytest.raises(UserError, match="foreign.h5: not a readable HDF5 file"):
        Run(tmp_path / "foreign.h5")


def test_a_truncated_file_is_named(finished):
    content = finished.read_bytes()
    finished.write_bytes(content[: len(content) // 2])
    with pytest.raises(UserError, match="deck.h5: not a readable HDF5 file"):
        Run(finished)


def test_a_file_name_in_quotes_is_one_value():
    text = '[balls]\nstart = "a # b.txt"   # random, or a file\nspeed = 0 m/s  # of every ball # at t = 0\n'
    found = [(entry.section, entry.key, entry.value) for entry in entries(text, "deck.ini")]
    assert found == [("balls", "start", "a # b.txt"), ("balls", "speed", "0 m/s")]
