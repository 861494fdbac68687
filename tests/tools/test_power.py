"""The formulas of the power of tumbling mills against worked mills and measured ones; `mill power`."""

import csv
import dataclasses
import json
import math
import re
import shutil
import subprocess

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SMALL, run_mill
from scipy.integrate import quad

import milltools
from milltools.__main__ import dispatch
from milltools.base.errors import UserError
from milltools.geometry import contour
from milltools.power import drum, models
from milltools.power.models import MODELS, Mill
from milltools.read.deck import Deck
from milltools.read.runfile import Run
from milltools.report import facts, run_page
from milltools.study.show import outputs, page, tumbling
from milltools.study.show.data import StudyView, opened

BOND = ROOT / "input/bond.ini"
FORMULA = {model.name: model for model in MODELS}
D = 0.305
JAR = Mill(D, D, 0.192325, 0.91396, ball=0.03683)  # Bond's mill, dry balls
LARGE = Mill(5, 7, 0.35, 0.75, pulp=models.pulp(2700, 0.7), discharge="grate")
DRUM = "[run]\ntime = 4 s\nsample_from = 1 s\nstarts = 4\n[drum]\nradius = 50 mm\nlength = 40 mm\nmotion = turn\n"
DRUM += "[motion.turn]\nkind = turn\naxis = 1 0 0\nspeed = 90 rpm\n[balls]\ncount = 40\ndiameter = 10 mm\n"
DRUM += "density = 7800 kg/m^3\n[contact]\nrestitution = 0.8\nfriction = 0.3\ntangential_restitution = 0.484\n"


def kilowatts(mill, **changes):
    """{name: kW} of all models."""
    mill = dataclasses.replace(mill, **changes)
    return {name: model.of(mill) / 1e3 for name, model in FORMULA.items()}


# ---- the worked mills


def test_the_critical_speed_is_the_one_of_the_trade_with_and_without_the_ball():
    assert JAR.critical * 30 / math.pi == pytest.approx(42.3 / math.sqrt(D), rel=1e-3) == pytest.approx(76.59, rel=1e-3)
    assert JAR.critical_of_ball * 30 / math.pi == pytest.approx(42.3 / math.sqrt(D - 0.03683), rel=1e-3)
    assert JAR.rate * 30 / math.pi == pytest.approx(70, rel=1e-4)


def test_bonds_mill_has_its_worked_powers():
    watts = [1e3 * kilowatts(JAR)[name] for name in ("Morrell C net", "Hogg & Fuerstenau", "Bond", "Austin SAG")]
    assert watts == pytest.approx([75.0, 89.5, 145.7, 97.5], abs=0.05)
    assert round(models.morrell_e_charge(JAR)) == 94
    assert [round(models.hogg_fuerstenau(JAR, math.radians(a))) for a in (30, 40)] == [78, 100]
    assert models.morrell_net(dataclasses.replace(JAR, charge=4960)) == pytest.approx(79.5, abs=0.05)
    assert JAR.ball_mass == pytest.approx(20.06, abs=0.005)


def test_a_mill_of_five_metres_has_its_worked_powers():
    assert (round(LARGE.pulp), round(LARGE.density), round(LARGE.ball_mass / 1e3, 1)) == (1788, 5395, 225.1)
    grate = {name: round(value) for name, value in kilowatts(LARGE).items()}
    assert grate == {
        "Morrell C net": 2663, "Morrell C gross": 3532, "Morrell E gross": 3434, "Hogg & Fuerstenau": 3035,
        "Bond": 3201, "Austin SAG": 3370,
    }  # fmt: skip
    over = {name: round(value) for name, value in kilowatts(LARGE, discharge="overflow").items()}
    assert (over["Morrell C net"], over["Morrell C gross"], over["Morrell E gross"]) == (2424, 3231, 3033)
    assert over["Bond"] == 2759
    lifted, thrown = models.charge_power(dataclasses.replace(LARGE, discharge="overflow"))
    assert (round(lifted / 1e3), round(thrown / 1e3)) == (2146, 278)
    assert round(kilowatts(LARGE, discharge="dry", pulp=0.0)["Morrell C net"]) == 2310
    assert round(models.no_load(LARGE) / 1e3) == 177


@pytest.mark.parametrize("mill, toe, shoulder", [(JAR, 244.2, 47.0), (LARGE, 224.4, 52.1)], ids=["jar", "large"])
def test_toe_and_shoulder_are_those_of_the_worked_mills(mill, toe, shoulder):
    assert np.degrees(models.toe_and_shoulder(mill)) == pytest.approx([toe, shoulder], abs=0.06)


def test_both_chambers_of_a_cement_mill_draw_the_published_power():
    """Erdem's mill, as fsantibanezleal/CAOS_ChargeCascade has it: kW net and without a charge."""
    first, second = Mill(3.27, 3.6, 0.2748, 0.7267), Mill(3.27, 7.0, 0.2663, 0.7267)
    net = [models.morrell_net(mill) / 1e3 for mill in (first, second)]
    idle = [models.no_load(mill) / 1e3 for mill in (first, second)]
    assert net == pytest.approx([341.97, 650.69], rel=1.1e-3)  # 4680 kg/m^3 of charge are rounded
    assert idle == pytest.approx([41.94, 72.35], abs=0.006)
    assert sum(models.morrell_gross(mill) for mill in (first, second)) / 1e3 == pytest.approx(1365.04, rel=1.1e-3)


@pytest.mark.parametrize("cone", [0.0, 0.8])
def test_the_c_model_is_the_integral_over_its_crescent(cone):
    """Layers at the radius r turn with v = 2 pi N R (r - z i) / (R - z i) in the cylinder, with 2 pi N r in cones."""
    mill = dataclasses.replace(LARGE, cone=cone)
    toe, shoulder = models.toe_and_shoulder(mill)
    plain_lifted, plain_thrown = models.charge_power(dataclasses.replace(mill, cone=0.0))
    radius, turns, density = 2.5, mill.rate / math.tau, mill.density
    drop = math.sin(shoulder) - math.sin(toe)
    span = math.tau + shoulder - toe
    rising = 2 * span / (math.tau * turns)
    mean = radius / 2 * (1 + math.sqrt(1 - math.tau * mill.filling / span))
    active = rising / (rising + math.sqrt(2 * mean * drop / 9.81))
    inner = radius * math.sqrt(1 - math.tau * active * mill.filling / span)
    slip = (1 - mill.filling) ** 0.4532

    def layer(r):
        return math.tau * turns * radius * (r - slip * inner) / (radius - slip * inner)

    lifted = mill.length * density * drop * 9.81 * quad(lambda r: layer(r) * r, inner, radius)[0]
    thrown = mill.length * density / 2 * quad(lambda r: layer(r) ** 3, inner, radius)[0]
    assert (plain_lifted, plain_thrown) == pytest.approx((lifted, thrown), rel=1e-9)
    slope = 2 * cone / (radius - radius / 4)  # of both
    lifts = quad(lambda end: density * drop * 9.81 * math.tau * turns * (end**3 - inner**3) / 3, inner, radius)[0]
    throws = quad(lambda end: density / 2 * (math.tau * turns) ** 3 * (end**4 - inner**4) / 4, inner, radius)[0]
    both = lifted + slope * lifts, thrown + slope * throws
    assert models.charge_power(mill) == pytest.approx(both, rel=1e-9)


def test_hogg_and_fuerstenau_is_the_locked_segment():
    """The weight of a segment of the circle with its surface at an angle, times its arm, to 1 % (see docs)."""
    for filling in (0.3, 0.45):
        half = math.pi / 2
        for _ in range(60):  # half the angle of the chord
            half -= ((half - math.sin(half) * math.cos(half)) / math.pi - filling) / (2 * math.sin(half) ** 2 / math.pi)
        mill = dataclasses.replace(LARGE, filling=filling, pulp=0.0)
        arm = 2 / 3 * 2.5**3 * math.sin(half) ** 3 * math.sin(models.REPOSE)
        locked = mill.density * mill.length * arm * 9.81 * mill.rate
        assert models.hogg_fuerstenau(mill) == pytest.approx(locked, rel=0.01)


# ---- measured mills


def measured(kind):
    """[(mill, measured power [W])] of Morrell's mills: 70 % of solids in the pulp, openings a quarter of the mill."""
    lines = (ROOT / "tests/tools/morrell.csv").read_text().splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        if row.pop("mill").startswith(kind):
            d, length, filling, balls, phi, mix, grate, power = map(float, row.values())
            ore = 1e3 * (mix - 0.3) / 0.7
            yield Mill(
                d, length, filling, phi, ball_filling=balls, ore=ore, pulp=models.pulp(ore, 0.7),
                discharge="grate" if grate else "overflow",
            ), 1e3 * power  # fmt: skip


@pytest.mark.parametrize(
    "name, kind, bias, scatter",
    [
        ("Morrell C gross", "BM", 4.2, 5.7),
        ("Morrell E gross", "BM", -0.8, 6.1),
        ("Bond", "BM", -4.2, 5.2),
        ("Hogg & Fuerstenau", "BM", -3.2, 8.9),
        ("Morrell C gross", "", 6.1, 8.0),
        ("Austin SAG", "SAG", 3.7, 11.3),
    ],
)
def test_the_models_miss_morrells_mills_by_the_told_bias_and_scatter(name, kind, bias, scatter):
    off = [100 * (FORMULA[name].of(mill) / power - 1) for mill, power in measured(kind)]
    assert len(off) == {"BM": 43, "SAG": 31, "": 82}[kind]
    assert (np.mean(off), np.std(off, ddof=1)) == pytest.approx((bias, scatter), abs=0.06)


def test_the_range_of_a_model_is_that_of_the_mills_it_names():
    for model in MODELS:
        kind = {"82": "", "43": "BM", "31": "SAG"}[next(word for word in model.mills.split() if word.isdigit())]
        mills = [mill for mill, _ in measured(kind)]
        for ends, key in zip((model.diameters, model.fillings, model.speeds), ("diameter", "filling", "speed")):
            values = [getattr(mill, key) for mill in mills]
            assert ends == (min(values), max(values))


def test_a_mill_outside_of_a_models_range_is_told_with_the_range():
    assert FORMULA["Bond"].outside(JAR) == (
        "D 0.305 m, not 0.85 to 5.34 m; J 19.2 %, not 20 to 48 %; speed 91.4 %, not 61 to 83 %"
    )
    assert FORMULA["Bond"].outside(LARGE) == ""
    assert FORMULA["Austin SAG"].outside(LARGE) == "balls without rock"


@pytest.mark.parametrize(
    "name, fastest", [("Morrell C net", 1.04), ("Morrell C gross", 1.04), ("Morrell E gross", 1.02), ("Bond", 1.23)]
)
def test_a_formula_gives_no_power_from_the_speed_on_at_which_it_fails(name, fastest):
    """With J 40 %: two factors below 0 are no power, nor is a charge that centrifuges."""
    mill = dataclasses.replace(LARGE, filling=0.4)
    speeds = np.linspace(0.6, 3, 241)
    given = np.isfinite([FORMULA[name].of(dataclasses.replace(mill, speed=speed)) for speed in speeds])
    assert given[speeds < fastest - 0.01].all() and not given[speeds > fastest + 0.01].any()


@pytest.mark.parametrize("filling, speed", [(5.0, 0.7), (0.3, 1e-3), (0.3, 5.0), (1e-9, 0.7), (1e300, 1e300)])
def test_where_a_formula_gives_no_power_there_is_none(filling, speed):
    for model in MODELS:
        value = model.of(dataclasses.replace(JAR, filling=filling, speed=speed))
        assert math.isnan(value) or value > 0


# ---- decks and runs


def test_the_deck_of_bonds_mill_is_the_worked_mill(the_program):
    mill = drum.mill_of(Deck.check(BOND))
    for field in ("diameter", "length", "filling", "speed", "ball_density", "ball"):
        assert getattr(mill, field) == pytest.approx(getattr(JAR, field), rel=1e-4), field


def test_a_drum_with_lifters_has_its_own_diameter_and_the_volume_within_its_wall(write_deck, the_program):
    lifters = "profile = lifters\nlifters = 6\nlifter_height = 8 mm\nlifter_width = 8 mm\n"
    deck = Deck.check(write_deck(DRUM.replace("motion = turn\n", f"motion = turn\n{lifters}", 1)))
    found, area = drum.mill_of(deck), contour.of(deck).area
    round_one = drum.mill_of(Deck.check(write_deck(DRUM)))
    assert (found.diameter, found.speed) == (round_one.diameter, round_one.speed)
    assert found.filling == pytest.approx(round_one.filling * math.pi * 0.05**2 / area, rel=1e-12)
    assert found.filling > 1.02 * round_one.filling


def test_the_mass_of_balls_is_that_of_the_run_in_every_shape(write_deck, tmp_path, the_program):
    (tmp_path / "wall.txt").write_text("0.06 0 0\n-0.03 0.04 0.1\n-0.03 -0.04 0\n")
    lifters = "profile = lifters\nlifters = 6\nlifter_height = 8 mm\nlifter_width = 8 mm\n"
    for shape in ("", lifters, "profile = file\nfile = wall.txt\n"):
        text = DRUM.replace("motion = turn\n", f"motion = turn\n{shape}", 1)
        deck = Deck.check(write_deck(text.replace("diameter = 10 mm", "diameter = 6 mm")))
        assert drum.mill_of(deck).ball_mass == pytest.approx(40 * math.pi / 6 * 0.006**3 * 7800, rel=1e-9)


def test_the_diameter_of_a_contour_from_a_file_is_the_decks_as_for_the_critical_speed(write_deck, tmp_path, mill):
    (tmp_path / "wall.txt").write_text("0.06 0 0\n-0.03 0.04 0\n-0.03 -0.04 0\n")
    text = DRUM.replace("motion = turn\n", "motion = turn\nprofile = file\nfile = wall.txt\n", 1)
    text = re.sub("speed = .*", "speed = 70 % critical", text).replace("diameter = 10 mm", "diameter = 6 mm")
    for radius in (50, 45):
        write_deck(text.replace("radius = 50 mm", f"radius = {radius} mm"))
        done = mill("power", "deck.ini")
        assert f"mill            {radius / 500:g} m x 0.04 m" in done.stdout, done.stderr
        assert "42.3/sqrt(D-d) of the largest ball, 6 mm: 70.0 %" in done.stdout


def test_a_drum_on_the_rotors_motion_turns_with_the_rotor(write_deck, the_program):
    text = DRUM.replace("motion = turn", "motion = rotor").replace(
        "[motion.turn]\nkind = turn\naxis = 1 0 0", "[rotor]"
    )
    deck = Deck.check(write_deck(text.replace("speed = 90 rpm", "speed = -90 rpm\nshaft_radius = 0 m")))
    assert drum.mill_of(deck).rate == pytest.approx(3 * math.pi)


@pytest.mark.parametrize(
    "changes, why",
    [
        ({"motion = turn\n": ""}, "drum.motion is not given, so the drum stands still"),
        ({"axis = 1 0 0": "axis = 0 0 1"}, "motion.turn does not turn about the drum's axis"),
        ({"axis = 1 0 0": "axis = 1 0 0\ncentre = 0 200 0 mm"}, "motion.turn does not turn about the drum's axis"),
        ({"[balls]": "[gravity]\nacceleration = 9.81 0 0 m/s^2\n[balls]"}, "its axis is not horizontal"),
        ({"[balls]": "[gravity]\nacceleration = 0 0 -1.62 m/s^2\n[balls]"}, "its gravity is 1.62 m/s^2, not 9.81 m/s^2"),  # noqa: E501
        ({"[balls]": "[rotor]\nspeed = 9 rpm\nshaft_radius = 0 m\n[balls]"}, "rotor does not turn with the drum"),
        ({"speed = 90 rpm": "speed = 0 rpm"}, "the drum does not turn"),
    ],
)  # fmt: skip
def test_what_is_no_horizontal_drum_gets_one_line_and_status_2(mill, write_deck, the_program, changes, why):
    text = DRUM
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    write_deck(text)
    done = mill("power", "deck.ini")
    line = f"mill power: deck.ini: expected a horizontal drum that turns about its axis: {why}\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", line)


def test_the_table_of_a_deck_has_each_model_with_its_basis(mill, the_program):
    done = mill("power", BOND)
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    for words in ("76.59 rpm, 42.3/sqrt(D): the mill turns at 91.4 % of it", "J 19.2 % with 40 % of voids: 20.06 kg",
                  "244.2, 47.0 deg from 3 o'clock", "−25.8, 137.0 deg from 6 o'clock"):  # fmt: skip
        assert any(words in line for line in lines), words
    (net,) = (line.split() for line in lines if line.startswith("Morrell C net  "))
    assert net == ["Morrell", "C", "net", "75.0", "W*", "charge", "net"]
    assert "ratio" not in done.stdout and "simulated" not in done.stdout
    assert max(map(len, lines)) <= 100


@pytest.fixture(scope="module")
def drum_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drum")
    (folder / "drum.ini").write_text(DRUM)
    subprocess.run([PROGRAM, "-q", "drum.ini", "-o", "drum.h5"], cwd=folder, check=True)
    return folder / "drum.h5"


def test_a_run_has_its_power_with_the_error_beside_each_model(mill, drum_run):
    found = json.loads(mill("power", drum_run, "--json").stdout)
    with milltools.load(drum_run) as result:
        power, error, table = result.power, result.power.error, result.power_models
    assert found["simulated"] == {"value": power.value, "standard_error": error, "unit": "W", "basis": "charge net"}
    for row in found["models"]:
        assert row["ratio"] == pytest.approx(power.value / row["value"])
        assert row["ratio_error"] == pytest.approx(error / row["value"])
    assert table["ratio"].tolist() == [row["ratio"] for row in found["models"]]
    assert table.index.tolist() == [model.name for model in MODELS]
    assert (
        f"simulated      {1e3 * power.value:.1f} ± {1e3 * error:.1f} mW, charge net\n" in mill("power", drum_run).stdout
    )


def test_the_page_of_a_drum_has_what_the_formulas_give_to_its_charge(drum_run):
    with Run(drum_run) as run:
        known, _, rows, remarks = run_page.formulas(run)
        (ratio,) = (row["ratio"] for row in drum.beside(run) if row["model"] == "Morrell C net")
        card, (of, charge) = {name: text for name, _, text in facts.tiles(run)}, facts.trade(run)
    assert [row[0] for row in rows] == [model.name for model in MODELS]
    assert rows[0][1] == "charge net" and rows[0][3].startswith(f"{ratio:.2f}")
    assert any("Hogg & Fuerstenau" in text and "D 0.1 m, not 0.85 to 5.34 m" in text for text in remarks)
    plainly = {name: value for name, value, _ in known}
    of, charge, said = (text.replace("\N{NO-BREAK SPACE}", " ") for text in (of, charge, card["toe, shoulder"]))
    assert known[2][1].endswith(of.removesuffix(" of the critical speed")) and of in said
    assert plainly["filling"].startswith(f"{charge} with")


def test_the_page_of_another_mill_has_no_formulas(tmp_path, the_program):
    (tmp_path / "deck.ini").write_text(SMALL)
    subprocess.run([PROGRAM, "-q", "deck.ini", "-o", "a.h5"], cwd=tmp_path, check=True)
    with Run(tmp_path / "a.h5") as run:
        assert run_page.formulas(run) == ([], [], [], []) and facts.trade(run) == []


@pytest.mark.parametrize("value", ["1e200", "1e-200", "0", "nan", "1e308 1 1", "x"])
@pytest.mark.parametrize(
    "key",
    ["balls/diameter", "balls/count", "drum/radius", "motion.turn/axis", "motion.turn/speed", "gravity/acceleration"],
)
def test_a_damaged_drum_gets_one_line_with_its_file(tmp_path, drum_run, capfd, key, value):
    path = tmp_path / "a.h5"
    shutil.copy(drum_run, path)
    with h5py.File(path, "r+") as file:
        del file[f"deck/{key}"]
        file[f"deck/{key}"] = value
    with pytest.raises(UserError) as fault:
        dispatch(["power", str(path)])
    assert fault.value.status == 2 and len(fault.value.lines) == 1 and str(path) in str(fault.value)
    assert capfd.readouterr() == ("", "")


def test_a_wet_mill_has_pulp_in_its_voids(mill, the_program):
    dry, wet = (
        json.loads(mill("power", BOND, "--json", *more).stdout)
        for more in ((), ("--discharge", "grate", "--ore", "3 g/cm^3", "--solids", "60 %", "--angle", "30 deg"))
    )
    assert wet["charge_density"] - dry["charge_density"] == pytest.approx(0.4 / (0.6 / 3000 + 0.4 / 1000))
    by_name = {row["model"]: row["value"] for row in wet["models"]}
    assert by_name["Hogg & Fuerstenau"] / models.hogg_fuerstenau(JAR) == pytest.approx(
        math.sin(math.radians(30)) / math.sin(models.REPOSE) * wet["charge_density"] / 4680, rel=1e-4
    )


@pytest.mark.parametrize(
    "words, line",
    [
        (("--ore", "3 g/cm^3"), "--ore: only of a wet mill, with --discharge grate or overflow"),
        (("--discharge", "grate", "--ore", "3 mm"), "--ore: expected a density such as '7800 kg/m^3', got '3 mm'"),
        (("--angle", "0 deg"), "--angle: expected more than 0, at most 1.5708, got '0 deg'"),
    ],
)
def test_a_wrong_option_is_one_line_and_status_2(mill, the_program, words, line):
    done = mill("power", BOND, *words)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"mill power: {line}\n")


# ---- a study


SPEEDS = "[study]\ndeck = drum.ini\nmaximise = power\n[set]\nrun.time = 0.2 s\nrun.sample_from = 0.1 s\n[vary]\n"
SPEEDS += "motion.turn.speed = 60, 80, 100 rpm\nballs.bulk_fill = 20, 30 %\n"


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    (folder / "drum.ini").write_text(DRUM)
    (folder / "speeds.study").write_text(SPEEDS)
    assert run_mill(folder, "sweep", "speeds.study", "--workers", "1", "--no-picture").returncode == 0
    return folder


@pytest.mark.slow
def test_a_study_of_the_speed_has_the_formulas_as_curves_for_each_filling(study):
    _, view = opened(study / "speeds.parquet")
    found = tumbling.mills(view, view.objectives[0])
    by_critical = [mill.speed * mill.critical * 30 / math.pi for mill in found]
    assert by_critical == pytest.approx(view.designs["motion.turn.speed"] * 30 / math.pi)
    assert [mill.filling for mill in found] == pytest.approx(view.designs["balls.bulk_fill"], abs=0.012)  # whole balls
    (ax,) = tumbling.draw(view, view.objectives[0], found).axes
    assert ax.get_legend_handles_labels()[1][:2] == list(tumbling.CURVES.values())
    curves = [line for line in ax.lines if len(line.get_xdata()) == 201]
    assert len(curves) == 2 * 2 * 2  # fillings, formulas, faint and in range
    assert curves[0].get_ydata()[0] == pytest.approx(models.morrell_net(found[0]))
    assert "tumbling" in [kind for kind, *_ in outputs.figures(view, view.objectives[0])]


@pytest.mark.slow
def test_a_study_of_another_mill_has_no_such_picture(study):
    _, view = opened(study / "speeds.parquet")
    other = {**view.meta, "deck": view.meta["deck"].replace("motion = turn", "")}
    assert tumbling.mills(StudyView("other", other, view.rows), view.objectives[0]) == []
    assert tumbling.mills(view, view.aim("power / mass")) == []


@pytest.mark.slow
def test_a_design_whose_filling_stands_for_the_number_of_balls_turns_in_the_page(study):
    _, view = opened(study / "speeds.parquet")
    assert 'class="missing"' not in page._mill(view, 0, 1_000_000)


@pytest.mark.slow
def test_the_cost_of_a_study_whose_runs_have_starts_is_told(study):
    done = run_mill(study, "sweep", "speeds.study", "--dry-run", "-o", "other.parquet")
    assert done.returncode == 0 and "\ncost       about " in done.stdout
