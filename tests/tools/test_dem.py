"""`mill dem` from its command line: wrong use, decks of every kind, what its file holds, and millsim beside it."""

import dataclasses
import math
import subprocess
import sys
import tempfile

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, SMALL, SMALL_START, lasting, run_mill, some
from dem_oracle import BLADES, MIXTURE

import milltools.dem.command
from milltools.__main__ import main
from milltools.base.errors import UserError
from milltools.dem.soft_mill import SoftMill
from milltools.read.kinds import KINDS
from milltools.read.runfile import Run

QUICK = "--modulus", "1e8", "--quiet"
TURNING = SMALL[SMALL.index("[rotor]") : SMALL.index("[contact]")]
NO_ROTOR = SMALL.replace(TURNING, "")
NO_BLADES = SMALL.replace(SMALL[SMALL.index("[blades]") : SMALL.index("[contact]")], "")


@dataclasses.dataclass
class Done:
    """How a command ended."""

    status: int
    out: str
    err: str


@pytest.fixture
def dem(tmp_path, monkeypatch, capsys, write_deck):
    """dem(deck text, *words) runs `mill dem deck.ini *words` in tmp_path. Single impacts and price, which have tests of
    their own, are left out unless whole=True. No test may leave anything among the temporary files."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    monkeypatch.chdir(tmp_path)

    def run(text, *words, whole=False):
        write_deck(text)
        monkeypatch.setattr(sys, "argv", ["mill", "dem", "deck.ini", *map(str, words)])
        with monkeypatch.context() as patch:
            if not whole:
                patch.setattr(milltools.dem.command.Job, "check_singles", lambda job: None)
                patch.setattr(SoftMill, "price", lambda *_: math.nan)
            status = main()
        out, err = capsys.readouterr()
        return Done(status, out, lasting(err))

    yield run
    assert list(scratch.iterdir()) == []


@pytest.fixture
def ran(dem):
    """ran(deck text, *words) runs it softly and returns the open Run of its file."""

    def run(text, *words, **options):
        done = dem(text, *QUICK, "--force", *words, **options)
        assert (done.status, done.err) == (0, ""), done.err
        return Run("deck-dem.h5")

    return run


# ---- wrong use ----


def sets(*pairs):
    return [word for pair in pairs for word in ("--set", pair)]


@pytest.mark.dem
@pytest.mark.parametrize(
    "words, line",
    [
        (["--bogus"], "unrecognized arguments: --bogus; see 'mill dem --help'"),
        (["--modulus", "hard"],
         "modulus 'hard': expected 'steel' or a Young's modulus from 1e5 to 1e13 Pa, such as 1e9 or '10 GPa'"),
        (["--modulus", "1e99"], "modulus '1e99': expected 'steel' or a Young's"),
        (["--modulus", "5 bar"], "modulus '5 bar': expected 'steel' or a Young's"),
        (["--modulus", "1e9", "--warm-up", "1 GPa"], "--warm-up 1 GPa is not softer than --modulus 1e9"),
        (["--warm-up", "x"], "modulus 'x': expected 'steel'"),
        (["--ranks", "0"], "--ranks 0: expected 1 or more"),
        (["--ranks", "two"], "argument --ranks: invalid int value: 'two'; see 'mill dem --help'"),
        (["--time", "5"], "--set run.time=5: [run] time: expected a time with its unit"),
        (["--set", "drum.radius=30 s"], "--set drum.radius=30 s: [drum] radius: expected a length"),
        (["--set", "nonsense"], "--set nonsense: "),
        (sets("contact.restitution=0"),
         "deck.ini: [contact] restitution of ball_ball: LIGGGHTS needs more than 0.05, got 0"),
        (sets("contact.ball_wall.restitution=0.03"),
         "deck.ini: [contact] restitution of ball_wall: LIGGGHTS needs more than 0.05, got 0.03"),
        (sets("drum.profile=wavy", "drum.buckles=5", "drum.buckle_height=1 mm"),
         "deck.ini: [drum]: its wall has arcs that are not on one circle: LIGGGHTS has no such primitive, and on a "
         "curved wall of triangles it adds up the forces of neighbours"),
        (sets("output.frames=1 us"), "deck.ini: [output] frames: 1e-06 s is less than "),
        (["--output", "there.h5"], "there.h5: exists already; --force overwrites it"),
        (["--output", "no/such.h5"], "no/such.h5: there is no folder no"),
        (["--output", "scratch", "--force"], "scratch: is a folder"),
        (["--output", "deck.ini", "--force"], "deck.ini: is the input file deck.ini itself; give another name"),
        (["--script", "old"], "old: contains an in.mill already; --force overwrites it"),
        (["--script", "new", "--warm-up", "1e7"], "--script writes a run of one stiffness: omit --warm-up"),
    ],
)  # fmt: skip
def test_wrong_use_is_one_line_and_status_2(dem, tmp_path, words, line):
    (tmp_path / "there.h5").touch()
    (tmp_path / "old").mkdir()
    (tmp_path / "old/in.mill").touch()
    done = dem(SMALL, *words)
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith(f"mill dem: {line}") and done.err.count("\n") == 1
    left = {"deck.ini", "there.h5", "old", "scratch"}
    assert {path.name for path in tmp_path.iterdir()} == left


def test_a_wrong_line_of_the_deck_is_told_as_millsim_tells_it(dem, millsim):
    text = SMALL.replace("friction = 0.3", "friction = 0.3\nstickiness = 2")
    done = dem(text)
    said = millsim("deck.ini")
    assert (done.status, said.returncode) == (2, 2)
    assert done.err == said.stderr.replace("millsim:", "mill dem:")


def test_a_deck_that_is_not_there_is_named(mill):
    done = mill("dem", "missing.ini")
    assert done.stderr == "mill dem: missing.ini: cannot be read: No such file or directory\n"
    assert done.returncode in (1, 2)


def test_without_liggghts_it_says_what_to_install(dem, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    done = dem(SMALL)
    assert done.status == 1
    assert done.err == "mill dem: LIGGGHTS is not installed; on Debian: sudo apt-get install liggghts\n"  # fmt: skip


def test_the_help_names_every_option_and_the_default(dem, capsys):
    with pytest.raises(SystemExit) as ended:
        dem(SMALL, "--help")
    out = capsys.readouterr().out
    assert ended.value.code == 0
    for word in ("--modulus E", "1e10", "--warm-up E", "--time", "--ranks", "--script FOLDER", "--force", "--set"):
        assert word in out


# ---- what a reader ought to know ----


@pytest.mark.parametrize(
    "words, notes",
    [
        (sets("contact.tangential_restitution=0.484"), []),
        (sets("contact.friction=0"), []),
        ([],
         ["tangential restitution 0 of ball_ball, ball_drum, ball_wall, ball_shaft, ball_blade has no counterpart in "
          "LIGGGHTS, which has 0.467 (damped) or 1: this run has 0.467"]),
        (sets("contact.tangential_restitution=0.484", "contact.ball_blade.tangential_restitution=0.9"),
         ["tangential restitution 0.9 of ball_blade has no"]),
        (sets("contact.tangential_restitution=0.484", "contact.ball_drum.restitution=0.65",
              "contact.ball_drum.tangential_restitution=0.26"),
         ["restitution below 0.7 with friction (ball_drum): LIGGGHTS' effective friction is far from the deck's there; "
          "do not compare"]),
        (["--warm-up", "1e7", *sets("contact.friction=0")], ["--warm-up has no effect: "]),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_told(dem, words, notes):
    done = dem(SMALL, *QUICK, "--time", "1 ms", *words)
    lines = done.err.splitlines()
    assert done.status == 0 and len(lines) == len(notes)
    for line, note in zip(lines, notes, strict=True):
        assert line.startswith(f"mill dem: note: {note}")


# ---- decks of every kind ----

START = "0.010 0.0262 0.001  0.5 -1 2  100 -200 30\n-0.012 -0.02 0.011  1 0.25 3  0 0 50\n"
FRICTION = "friction = 0.3\ntangential_restitution = 0.484"
DECKS = {
    "no rotor": (NO_ROTOR, []),
    "no blades": (NO_BLADES, []),
    "pitched single blades": (SMALL + BLADES, ["blades.pitch=30 deg"]),
    "a rotor turning back": (SMALL, ["rotor.speed=-600 rpm"]),
    "a rotor at rest": (SMALL, ["rotor.speed=0 rpm"]),
    "two kinds of balls": (MIXTURE, []),
    "no gravity, flying balls": (SMALL, ["gravity.acceleration=0 0 0 m/s^2", "balls.speed=2 m/s"]),
    "gravity askew": (SMALL, ["gravity.acceleration=3 -4 5 m/s^2"]),
    "one ball": (SMALL, ["balls.count=1"]),
    "elastic": (SMALL, ["contact.restitution=1", "contact.tangential_restitution=1"]),
    "no friction": (SMALL, ["contact.friction=0"]),
    "laws by kind": (SMALL, ["contact.ball_blade.restitution=0.81", "contact.ball_ball.friction=0"]),
    "all impacts": (SMALL, ["output.impacts=all"]),
    "a rare series": (SMALL, ["output.series=50 ms"]),
}  # fmt: skip


@pytest.mark.parametrize("name", some(DECKS, 3))
@pytest.mark.slow
def test_every_deck_runs_from_millsims_own_start(ran, millsim, name, tmp_path):
    text, overrides = DECKS[name]
    text = text.replace("friction = 0.3", FRICTION)
    overrides = sets(*(o for o in overrides if "tangential" not in o or "contact.restitution=1" in overrides))
    with ran(text, "--time", "6 ms", *overrides) as run:
        done = millsim("deck.ini", "-q", "-f", "-s", "run.time=6 ms", *overrides)
        assert done.returncode == 0, done.stderr
        with Run(tmp_path / "deck.h5") as own:
            for state in ("position", "velocity", "angular_velocity"):
                assert np.array_equal(run.frame(0, state), own.frame(0, state)), state
            assert run.frame(1, "position").shape == own.frame(1, "position").shape
            assert np.isfinite(run.frame(1, "velocity")).all()
            for balls in ("mass", "diameter", "species"):
                assert run.balls(balls) == pytest.approx(own.balls(balls), rel=1e-15)
        assert (run.program, run.status, run.time) == ("LIGGGHTS", "complete", 0.006)
        assert run.version.startswith("LIGGGHTS")
        radius = run.balls("diameter") / 2
        place = run.frame(1, "position")
        assert (np.hypot(place[:, 1], place[:, 2]) < 0.03 - 0.8 * radius).all()
        assert (abs(place[:, 0]) < 0.02 - 0.8 * radius).all()


@pytest.mark.dem
def test_balls_fly_as_started_until_they_meet_something(ran, tmp_path):
    (tmp_path / "start.txt").write_text(START)
    text = SMALL.replace("count = 20", "count = 2\nstart = start.txt")
    text = text.replace("friction = 0.3", FRICTION).replace("frames = 5 ms", "frames = 0.5 ms")
    start = np.array([line.split() for line in START.splitlines()], float)
    with ran(text, "--time", "1 ms", "--set", "gravity.acceleration=3 -4 5 m/s^2") as run:
        assert run.read("statistics/impacts/all/count") == 0
        for k, t in enumerate(run.frame_times()):
            flight = start[:, :3] + start[:, 3:6] * t + np.array([3, -4, 5]) * t * t / 2
            assert t == pytest.approx(k * 5e-4, abs=2e-5)
            assert run.frame(k, "position") == pytest.approx(flight, abs=1e-8)
            fall = start[:, 3:6] + np.array([3, -4, 5]) * t
            assert run.frame(k, "velocity") == pytest.approx(fall, abs=1e-6)
            assert run.frame(k, "angular_velocity") == pytest.approx(start[:, 6:], rel=1e-7)


def first_impacts(run, end):
    """{(kind, ball, partner): (time, normal speed, slip, normal)} of impacts before `end` that are the first of all
    their balls."""
    columns = [
        run.read(f"impacts/{name}")
        for name in ("kind", "ball", "partner", "time", "normal_speed", "tangential_speed", "normal")
    ]
    met, found = set(), {}
    for kind, ball, partner, *told in sorted(zip(*columns, strict=True), key=lambda row: row[3]):
        balls = {int(ball), int(partner)} if kind == 0 else {int(ball)}
        if not balls & met and told[0] < end:
            found[int(kind), int(ball), int(partner)] = told
        met |= balls
    return found


@pytest.mark.slow
@pytest.mark.parametrize("speed", [900, -900])
def test_the_first_impacts_are_millsims_in_partner_time_speed_and_normal(ran, millsim, tmp_path, speed):
    """Up to a ball's first impact both fly freely, so both must meet the same surfaces: geometry, rotor and solving
    back."""
    text = SMALL.replace("friction = 0.3", FRICTION) + BLADES
    words = sets(
        "output.impacts=all",
        f"rotor.speed={speed} rpm",
        "blades.pitch=35 deg",
        "balls.count=60",
        "balls.speed=1 m/s",
        "rotor.angle=25 deg",
    )
    with ran(text, "--time", "12 ms", "--modulus", "1e9", *words) as run:
        assert millsim("deck.ini", "-q", "-s", "run.time=12 ms", *words).returncode == 0
        with Run(tmp_path / "deck.h5") as own:
            ours, theirs = first_impacts(run, 0.0115), first_impacts(own, 0.0115)
    assert ours.keys() == theirs.keys() and len(ours) > 20
    assert sum(kind == 4 for kind, *_ in ours) >= 3
    for key, (time, normal_speed, slip, normal) in ours.items():
        wanted = theirs[key]
        assert time == pytest.approx(wanted[0], abs=2e-6), key
        assert normal_speed == pytest.approx(wanted[1], rel=0.02, abs=0.002), key
        assert slip == pytest.approx(wanted[2], rel=0.02, abs=0.005), key
        assert normal == pytest.approx(wanted[3], abs=0.01), key


# ---- what the file holds ----


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """(file of mill dem, millsim's file) of one deck: two kinds of balls, every impact logged."""
    folder = tmp_path_factory.mktemp("files")
    (folder / "deck.ini").write_text(MIXTURE.replace("friction = 0.3", FRICTION) + "impacts = all\n")
    times = sets("run.time=12 ms", "run.sample_from=2 ms", "rotor.speed=3000 rpm")
    done = run_mill(folder, "dem", "deck.ini", "--quiet", "--modulus", "1e8", *times)
    assert (done.returncode, done.stderr) == (0, "")
    (folder / "said.txt").write_text(done.stdout)
    subprocess.run([PROGRAM, "-q", "deck.ini", *times], cwd=folder, check=True, capture_output=True)
    return folder / "deck-dem.h5", folder / "deck.h5"


def tree(path):
    """{name: (type, unit)} of all datasets, under all their names."""
    found = {}

    def walk(group):
        for name, item in group.items():
            if isinstance(item, h5py.Group):
                walk(item)
            else:
                found[f"{group.name.rstrip('/')}/{name}"] = str(item.dtype), item.attrs["unit"]

    with h5py.File(path) as file:
        for name in ("particles", "observables", "impacts", "deck", "run", "statistics"):
            walk(file[name])
    return found


def test_the_file_has_millsims_names_types_and_units(files):
    ours, theirs = map(tree, files)
    millsims = (
        "/run/",
        "/statistics/energies/",
        "/statistics/wear/",
        "/VTKHDF/wear/",
        "/statistics/precision/",
        "/statistics/rotor/pinch_power",
        "/statistics/drive/pinch_power",
    )
    assert [n for n in theirs if n not in ours and not n.startswith(millsims)] == []
    extra = {n for n in ours.keys() - theirs.keys() if not n.startswith("/run/")}
    assert extra == {f"/observables/elastic_energy/{name}" for name in ("step", "time", "value")}
    for name in ours.keys() & theirs.keys():
        assert ours[name] == theirs[name], name
    with h5py.File(files[0]) as file:
        for _, item in (pair for group in file.values() for pair in getattr(group, "items", list)()):
            for dataset in [item] if isinstance(item, h5py.Dataset) else []:
                assert dataset.attrs["description"]


@pytest.mark.dem
def test_the_facts_of_the_run_are_told(files):
    with Run(files[0]) as run:
        assert (run.read("run/modulus"), run.read("run/ranks")) == (1e8, 1)
        assert (
            run.read("run/tools")
            == subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout.split()[1]
        )
        assert run.read("run/command").startswith("mill dem deck.ini --quiet --modulus 1e8")
        interval = run.read("run/sample_interval")
        assert interval == pytest.approx(5 * run.read("run/time_step"))
        assert run.read("run/contact_duration") > 8 * interval * (1 - 1e-9) or run.read("run/contact_duration") > 0
        assert run.read("run/cpu_time") > 0
        assert run.read("run/wall_time") > 0
        for kind in KINDS:
            assert run.read(f"run/measured/{kind}/restitution") == pytest.approx(0.8, abs=0.01)
            assert 0.3 < run.read(f"run/measured/{kind}/friction") < 0.33
            assert run.read(f"run/measured/{kind}/tangential_restitution") == pytest.approx(0.467, abs=0.01)


@pytest.mark.dem
def test_rows_and_log_and_statistics_tell_of_the_same_impacts(files):
    with Run(files[0]) as run:
        time, kind = run.read("impacts/time"), run.read("impacts/kind")
        assert len(time) > 100 and (np.diff(time) >= 0).all() and 0 <= time[0] and time[-1] <= 0.012
        for number, name in enumerate(KINDS):
            rows, total = run.series(f"collisions/{name}")
            assert total[-1] == np.sum((kind == number) & (time < rows[-1]))
            window = (kind == number) & (time >= 0.002)
            assert run.read(f"statistics/impacts/{name}/count") == window.sum()
        assert rows == pytest.approx(np.arange(13) * 1e-3, abs=1e-12)


@pytest.mark.dem
def test_work_energies_and_losses_balance_by_construction_and_losses_grow(files):
    with Run(files[0]) as run:
        energies = sum(
            run.series(name)[1]
            for name in ("kinetic_energy", "rotational_energy", "potential_energy", "elastic_energy")
        )
        work, loss = run.series("rotor_work")[1], 0.0
        for kind in KINDS:
            loss = loss + run.series(f"dissipation/{kind}")[1]
            assert (np.diff(run.series(f"dissipation_normal/{kind}")[1]) >= 0).all()
        assert work - (energies - energies[0]) - loss == pytest.approx(np.zeros(13), abs=1e-12)
        torque = run.series("rotor_torque")[1]
        assert np.cumsum(torque) * 1e-3 * run.rotor_speed == pytest.approx(work, rel=1e-9, abs=1e-15)
        assert work[-1] > 0


@pytest.mark.dem
def test_the_summary_says_what_the_file_holds(files):
    said = (files[0].parent / "said.txt").read_text()
    with Run(files[0]) as run:
        for kind in (*KINDS, "all"):
            count = run.read(f"statistics/impacts/{kind}/count")
            assert f"\n{kind:<12}{count:>11}" in said
        assert f"rotor power        {run.read('statistics/rotor/power'):.4g} W" in said
    assert max(map(len, said.splitlines())) <= 120
    assert "\nfile               deck-dem.h5\nnote: at 1e+08 Pa balls touch several others" in said


@pytest.mark.dem
def test_without_friction_the_energy_account_closes(ran):
    words = sets("contact.friction=0", "balls.count=100", "rotor.speed=3000 rpm")
    with ran(SMALL, "--time", "10 ms", "--modulus", "1e9", *words) as run:
        assert run.read("run/energy_turnover") > 0.01
        assert run.read("run/energy_balance_error") < 0.02
        assert run.series("rotational_energy")[1].max() == 0


@pytest.mark.dem
def test_a_rubbing_shaft_turns_the_balls_and_its_torque_is_in_the_series(ran, tmp_path):
    """Two balls that are pressed onto a bare shaft, which slips under them for the first 3 ms."""
    (tmp_path / "start.txt").write_text("-0.008 0 0.0075001\n0.008 0 0.0075001\n")
    text = NO_BLADES.replace("count = 20", "count = 2\nstart = start.txt")
    text = text.replace("friction = 0.3", FRICTION)
    with ran(text, "--time", "2 ms", "--set", "gravity.acceleration=0 0 -98.1 m/s^2") as run:
        torque, work = run.series("rotor_torque")[1], run.series("rotor_work")[1]
        weight = run.balls("mass").sum() * 98.1
        assert torque[2] == pytest.approx(0.3 * weight * 0.005, rel=0.1)
        assert work[-1] == pytest.approx(torque.sum() * 1e-3 * run.rotor_speed, rel=1e-9)
        assert run.frame(0, "angular_velocity").max() == 0
        assert run.series("rotational_energy")[1][-1] > 0


# ---- the same again, the same elsewhere ----


def values(path):
    with h5py.File(path) as file:
        found = {}
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    return {
        name: np.asarray(v).tobytes()
        for name, v in found.items()
        if not name.startswith("run/") and np.asarray(v).dtype.kind != "O"
    }


@pytest.mark.dem
def test_two_runs_give_the_same_bits(dem, tmp_path):
    text = SMALL.replace("friction = 0.3", FRICTION)
    for name in ("a.h5", "b.h5"):
        assert dem(text, *QUICK, "--time", "6 ms", "-o", name, *sets("balls.count=100")).status == 0
    one, two = values(tmp_path / "a.h5"), values(tmp_path / "b.h5")
    assert len(one) > 100 and one == two


@pytest.mark.slow
def test_two_ranks_give_the_same_physics(ran):
    words = sets("balls.count=150", "rotor.speed=3000 rpm", "contact.tangential_restitution=0.484")
    told = []
    for ranks in (1, 2):
        with ran(SMALL, "--time", "6 ms", "--ranks", ranks, *words) as run:
            energy = run.series("kinetic_energy")[1][-1]
            told.append((energy, run.series("rotor_work")[1][-1], run.read("statistics/impacts/all/count")))
            assert run.frame(-1, "position").shape == (150, 3)
            assert run.read("run/ranks") == ranks
    assert told[1] == pytest.approx(told[0], rel=0.1)
    assert told[0][2] > 100


@pytest.mark.slow
def test_a_warm_up_hands_all_balls_over_without_overlaps_and_the_rows_go_on(ran):
    words = [
        "--time",
        "28 ms",
        "--warm-up",
        "1e7",
        *sets("run.sample_from=24 ms", "balls.count=150"),
    ]
    with ran(SMALL.replace("friction = 0.3", FRICTION), *words) as run:
        assert run.read("run/warm_up_time") == pytest.approx(0.004)
        assert run.read("run/warm_up_modulus") == 1e7
        time, energy = run.series("kinetic_energy")
        assert time == pytest.approx(np.arange(29) * 1e-3, abs=1e-9)
        assert np.isfinite(energy).all()
        assert run.window == pytest.approx((0.024, 0.028))


@pytest.mark.slow
def test_blades_go_on_from_their_angle_after_a_warm_up(ran, millsim, tmp_path):
    """A ball that floats in the way of a blade, which comes after the hand-over."""
    (tmp_path / "start.txt").write_text("-0.01 0.0 0.016\n")
    text = SMALL.replace("count = 20", "count = 1\nstart = start.txt").replace("friction = 0.3", FRICTION)
    words = sets(
        "gravity.acceleration=0 0 0 m/s^2",
        "rotor.angle=-30 deg",
        "rotor.speed=1200 rpm",
        "output.impacts=all",
        "run.sample_from=24 ms",
        "output.frames=1 ms",
    )
    with ran(text, "--time", "26 ms", "--warm-up", "1e7", "--modulus", "1e9", *words) as run:
        assert millsim("deck.ini", "-q", "-s", "run.time=26 ms", *words).returncode == 0
        with Run(tmp_path / "deck.h5") as own:
            ours, theirs = first_impacts(run, 0.026), first_impacts(own, 0.026)
            assert ours.keys() == theirs.keys() == {(4, 0, 0)}
            when, *_ = theirs[4, 0, 0]
            assert when > 0.005
            assert ours[4, 0, 0][0] == pytest.approx(when, abs=2e-6)
            after = math.ceil(when * 1e3 + 0.2)  # frames of 1 ms
            assert run.frame(after - 1, "velocity") == pytest.approx(np.zeros((1, 3)), abs=1e-12)
            thrown = own.frame(after, "velocity")
            assert np.linalg.norm(thrown) > 1
            assert run.frame(after, "velocity") == pytest.approx(thrown, abs=0.1)


# ---- LIGGGHTS' own input ----


@pytest.mark.dem
def test_the_script_runs_in_plain_liggghts_and_keeps_every_ball(dem, tmp_path):
    done = dem(MIXTURE + BLADES, *QUICK, "--time", "6 ms", "--script", "by hand")
    assert (done.status, done.err) == (0, "")
    assert done.out.startswith("by hand: in.mill, balls.data, blades.stl; run there: liggghts ")
    words = done.out.split("run there: ")[1].split()
    folder = tmp_path / "by hand"
    ended = subprocess.run(words, cwd=folder, capture_output=True, timeout=60)
    assert ended.returncode == 0
    screen = (folder / "screen.txt").read_text()
    assert "containing 48 triangle(s)" in screen and "ERROR" not in screen
    assert " steps with 120 atoms" in screen
    frame = 100 + 4 + 120 * 10 * 8
    assert (folder / "state.bin").stat().st_size == 2 * frame  # at 0 and 5 ms
    assert sum(path.stat().st_size for path in folder.iterdir()) < 1e6


@pytest.mark.dem
def test_a_failure_in_mid_run_keeps_the_results_up_to_then(dem, monkeypatch):
    samples = milltools.dem.soft_mill.Liggghts.samples

    def lose(process, count):
        for step, rows in samples(process, count):
            if step > 300:
                raise UserError("LIGGGHTS lost 1 of 20 balls", 1)
            yield step, rows

    monkeypatch.setattr(milltools.dem.soft_mill.Liggghts, "samples", lose)
    done = dem(SMALL, *QUICK, "--set", "contact.friction=0")
    assert (done.status, done.out) == (1, "")
    told = "mill dem: LIGGGHTS lost 1 of 20 balls; results up to 2.4 ms are in deck-dem.h5\n"
    assert done.err == told
    with Run("deck-dem.h5") as run:
        assert (run.status, len(run.series("kinetic_energy")[0])) == ("failed", 3)
        assert run.time == pytest.approx(0.0024)


@pytest.mark.dem
def test_a_price_that_cannot_be_measured_does_not_fail_the_run(dem, monkeypatch):
    def fail(*_):
        raise UserError("LIGGGHTS failed with status 1", 1)

    monkeypatch.setattr(SoftMill, "price", fail)
    monkeypatch.setattr(milltools.dem.command.Job, "check_singles", lambda job: None)
    done = dem(SMALL, *QUICK, *sets("contact.friction=0", "run.time=2 ms"), whole=True)
    assert done.status == 0 and "without it - s per simulated second" in done.out
    assert done.err == "mill dem: note: the cost of LIGGGHTS alone was not measured: LIGGGHTS failed with status 1\n"
    with Run("deck-dem.h5") as run:
        assert run.status == "complete" and math.isnan(run.read("run/price"))


def test_start_positions_that_overlap_are_millsims_error(dem, tmp_path):
    (tmp_path / "start.txt").write_text(SMALL_START.replace("0.016 0.027", "0.012 0.027"))
    done = dem(SMALL.replace("count = 20", "count = 20\nstart = start.txt"), *QUICK)
    assert done.status == 2 and done.err.count("\n") == 1
    assert "overlap" in done.err
