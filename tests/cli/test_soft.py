"""millsim --soft: what users see of soft spheres, and of bridges of hard ones."""

import json
import re

import h5py
import numpy as np
import pytest
from results import OWN, assert_same, differences
from test_resume import ENDLESS, SHORT, Folder

WORKING = "soft spheres have time steps and no events"


def sets(*values):
    return [word for value in values for word in ("-s", value)]


def read(file, name):
    with h5py.File(file) as f:
        value = f[name][()]
    return value.decode() if isinstance(value, bytes) else value


@pytest.fixture
def soft(millsim, small_deck, tmp_path):
    """The file of a run of the small mill with soft spheres, and its summary"""

    def run(*more):
        done = millsim("--soft", "-q", "--json", "--force", "-o", "soft.h5", *more, small_deck)
        assert done.returncode == 0, done.stderr
        return tmp_path / "soft.h5", json.loads(done.stdout)

    return run


# ---- the command ----


@pytest.mark.slow
def test_the_option_is_the_key(millsim, small_deck, soft, tmp_path):
    option, _ = soft()
    done = millsim("-s", "run.spheres=soft", "-q", "-o", "key.h5", small_deck)
    assert done.returncode == 0, done.stderr
    assert_same(option, tmp_path / "key.h5")
    assert (read(option, "deck/run/spheres"), read(option, "deck/soft/modulus")) == ("soft", "1000000000 Pa")


def test_the_last_word_on_the_spheres_counts(printed, small_deck):
    assert printed("--soft", small_deck)["run.spheres"] == "soft"
    assert printed("--soft", "-s", "run.spheres=hard", small_deck)["run.spheres"] == "hard"


def test_help_has_the_option(millsim):
    assert re.search(r"^ +--soft +compute with soft spheres", millsim("--help").stdout, re.MULTILINE)


@pytest.mark.parametrize("other", [["--digest"], ["--value=run.seed=1"], ["--examples=here"], ["--paranoid"]])
def test_what_excludes_soft_spheres_is_told(refused, small_deck, other):
    name = other[0].split("=")[0]
    deck = [small_deck] if name in ("--digest", "--paranoid") else []
    assert refused("--soft", *other, *deck) == f"options '--soft' and '{name}' exclude each other: {WORKING}"


def test_paranoid_asks_for_hard_spheres_however_soft_ones_are_asked_for(refused, small_deck):
    said = refused("--paranoid", "-s", "run.spheres=soft", small_deck)
    assert said == "option '--paranoid' checks the events of hard spheres: omit it, or set run.spheres=hard"


@pytest.mark.parametrize(
    "value, complaint",
    [
        ("soft.modulus=10", "expected a pressure with its unit such as '8 GPa', or 'steel', got '10'"),
        ("soft.modulus=iron", "expected a pressure with its unit such as '8 GPa', or 'steel', got 'iron'"),
        ("soft.modulus=1 kPa", "must be between 100000 and 10000000000000 Pa, got '1 kPa'"),
        ("soft.law=cubic", "expected 'linear' or 'hertz', got 'cubic'"),
        ("soft.steps=9", "must be between 10 and 10000, got '9'"),
        ("soft.module=1 GPa", "unknown key; did you mean 'modulus'?"),
        ("run.spheres=wet", "expected 'hard' or 'soft', got 'wet'"),
    ],
)
def test_a_wrong_value_is_told(refused, small_deck, value, complaint):
    (section, key), wrong = value.split("=")[0].split("."), value
    assert refused(*sets(wrong), small_deck) == f"--set {wrong}: [{section}] {key}: {complaint}"


@pytest.mark.parametrize("value, pascals", [("steel", "210000000000"), ("10 GPa", "10000000000"), ("5 MPa", "5000000")])
def test_a_modulus_is_a_pressure_or_steel(millsim, value, pascals):
    columns = millsim(f"--value=soft.modulus={value}").stdout.rstrip("\n").split("\t")
    assert (columns[2], columns[3], columns[5]) == (pascals, "Pa", "steel")


# A deck is printed whole, but what belongs to the other spheres would be noise in it.
def test_keys_of_soft_spheres_are_printed_with_soft_spheres_only(printed, small_deck):
    assert not [key for key in printed(small_deck) if key.startswith("soft.")]
    told = printed("--soft", "-s", "soft.modulus=steel", small_deck)
    assert (told["soft.law"], told["soft.steps"]) == ("linear", "40")
    assert told["soft.modulus"] in ("steel", "210 GPa", "210000000000 Pa", "2.1e+11 Pa")


def test_the_forecast_tells_duration_and_step(millsim, small_deck):
    said = millsim("--check", "--soft", small_deck).stderr
    lasts, step = re.search(r"the shortest contact lasts (\S+) s, in steps of (\S+) s\n", said).groups()
    assert float(lasts) / 40 * 0.99 < float(step) <= float(lasts) / 40
    said = millsim("--check", "--soft", *sets("soft.modulus=10 GPa", "soft.steps=80"), small_deck).stderr
    stiff, fine = re.search(r"lasts (\S+) s, in steps of (\S+) s\n", said).groups()
    assert float(stiff) == pytest.approx(float(lasts) * 10**-0.4, rel=1e-4)  # as E^-2/5
    assert float(fine) == pytest.approx(float(stiff) / 80, rel=0.01)


# ---- results ----


def test_the_file_tells_step_contacts_and_elastic_energy(soft):
    with h5py.File(soft()[0]) as f:
        own, kinds = f["run/soft"], f["run/events/collisions"]
        assert own["steps"][()] == pytest.approx(0.05 / own["time_step"][()], abs=1)
        assert 39.6 < own["contact_duration"][()] / own["time_step"][()] <= 40.0 * 1.01
        told = sum(kinds[name][()] for name in kinds)
        assert 0 <= own["contacts"][()] - told <= 10  # those that still last are not told yet
        assert 0 <= own["crowded"][()] < own["contacts"][()]
        assert own["largest_force"][()] > 0
        series = f["observables/elastic_energy/value"][:]
        assert series[-1] == pytest.approx(own["elastic_energy"][()], abs=1e-12)
        assert (series >= 0).all() and series.max() > 0
        assert f["run/energy_balance_error"][()] < 1e-4


# An upper bound of the speed of the tips
def test_the_fastest_surface_sets_the_stiffness(soft):
    tip = 600 * np.pi / 30 * np.hypot(0.022, 0.002)
    slow, _ = soft()
    assert tip < read(slow, "run/soft/speed") < 1.2 * tip
    lasts = read(slow, "run/soft/contact_duration")
    fast, _ = soft(*sets("rotor.speed=6000 rpm", "run.time=1 ms"))
    assert read(fast, "run/soft/contact_duration") == pytest.approx(lasts * 10**-0.2, rel=1e-6)  # Hertz


def test_hard_spheres_have_no_soft_results(millsim, small_deck, tmp_path):
    assert millsim("-q", "-o", "hard.h5", small_deck).returncode == 0
    with h5py.File(tmp_path / "hard.h5") as f:
        assert "soft" not in f["run"] and "elastic_energy" not in f["observables"]
        assert (f["run/bridges"][()], f["run/bridge_work"][()]) == (0, 0.0)


def test_stiffer_balls_are_pressed_in_less_and_the_notes_tell_when_it_is_much(soft):
    deep = {}
    for modulus in ("1 MPa", "10 GPa"):
        file, summary = soft(*sets(f"soft.modulus={modulus}"))
        deep[modulus] = read(file, "run/largest_overlap")
        pressed = [note for note in summary["notes"] if "pressed in" in str(note)]
        assert bool(pressed) == (modulus == "1 MPa"), summary["notes"]
    # as E^-2/5 at equal speeds
    assert 10 < deep["1 MPa"] / deep["10 GPa"] < 160


@pytest.mark.slow
def test_an_interrupted_run_goes_on_to_the_same_bits(tmp_path):
    text = SHORT.replace("time = 0.45 s", "time = 0.1 s")
    for name in ("whole", "broken"):
        (tmp_path / name).mkdir()
    whole, broken = (Folder(tmp_path / name, text) for name in ("whole", "broken"))
    whole.finish("--soft")
    status, said = broken.stop("--soft", "-q")
    assert status == 130, said
    broken.finish("--soft", "--resume")
    assert_same(whole.file, broken.file)


@pytest.mark.slow
def test_a_run_of_hard_spheres_is_not_resumed_as_soft(tmp_path):
    folder = Folder(tmp_path, ENDLESS)
    folder.stop("-q")
    status, said = folder.run("--soft", "-q", "--resume")
    assert status == 2 and "spheres" in said, said


@pytest.mark.slow
def test_threads_change_no_result(tmp_path):
    files = []
    for threads in (1, 2):
        (tmp_path / str(threads)).mkdir()
        folder = Folder(tmp_path / str(threads), SHORT.replace("time = 0.45 s", "time = 0.06 s"))
        folder.finish("--soft", "-s", f"run.threads={threads}")
        files.append(folder.file)
    apart = (*OWN, "/deck/run/threads", "/deck/text")
    assert differences(*files, apart) == []


# ---- bridges ----

BRIDGE = """\
[run]
time = 5 ms
[motion.shaft]
kind = turn
axis = 1 0 0
speed = 4000 rpm
[body.chamber]
shape = cylinder
side = inside
axis = 1 0 0
radius = 40 mm
length = 40 mm
[body.disc]
shape = cylinder
motion = shaft
centre = -10 0 0 mm
axis = 1 0 0
radius = 30 mm
length = 5 mm
copies = 2
shift_by = 20 0 0 mm
[balls]
count = 2
start = two.txt
diameter = 4 mm
density = 6050 kg/m^3
[contact]
restitution = 0.9
friction = 0.3
tangential_restitution = 0.4
[output]
frames = 0 s
"""
TWO = """\
0.0145005407 -0.003782477 0.00954240747 -0.31316781 -0.388314545 -0.75747478 -169.725876 -269.346954 132.627151
0.0179969762 -0.00571734505 0.00972228963 0.426624835 -0.281238586 0.0265108906 -129.213867 -3.08179712 -92.3974991
"""


def test_a_bridge_gives_way_and_its_work_and_a_note_are_told(millsim, write_deck, tmp_path):
    (tmp_path / "two.txt").write_text(TWO)
    done = millsim("-q", "--json", "-o", "b.h5", write_deck(BRIDGE))
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert read(tmp_path / "b.h5", "run/bridges") == 1
    assert 0 < read(tmp_path / "b.h5", "run/bridge_work") < 0.01
    (note,) = (str(note) for note in summary["notes"] if "bridge" in str(note))
    assert "in gaps of 1.83 to 2 diameters" in note  # 1 + cos(2 atan 0.3)


# The referee needs no rule for bridges: its balls give way by themselves.
@pytest.mark.slow
def test_soft_balls_of_steel_do_about_the_same_work(millsim, write_deck, tmp_path):
    (tmp_path / "two.txt").write_text(TWO)
    deck, work = write_deck(BRIDGE), {}
    for spheres in ("hard", "soft"):
        done = millsim("-q", "-o", f"{spheres}.h5", *sets(f"run.spheres={spheres}", "soft.modulus=steel"), deck)
        assert done.returncode == 0, done.stderr
        work[spheres] = read(tmp_path / f"{spheres}.h5", "observables/motion_work/shaft/value")[-1]
    assert 0.0025 < work["soft"] < 0.0045
    assert 0.7 < work["hard"] / work["soft"] < 1.5
