"""Dose and wear of a run, against the log of all its impacts and against cases worked by hand."""

import dataclasses
import json
import math
import re
import shutil
import subprocess
import types

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SMALL
from matplotlib.figure import Figure as Canvas
from scipy.special import ndtri, stdtrit

from milltools.base.errors import UserError
from milltools.dose import dose, laws, wear
from milltools.figures import FIGURES, spectra
from milltools.figures.wear import limits
from milltools.read import sums
from milltools.read.runfile import Run
from milltools.read.wear import Wear
from milltools.render import colour

BALLS = "[balls]\ncount = 20\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
MIXED = (
    SMALL.replace("time = 50 ms", "time = 500 ms\nsample_from = 100 ms\nseed = 2")
    .replace("600 rpm", "600 rpm\nangle = 20 deg")
    .replace(
        BALLS,
        "[balls.big]\ncount = 40\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
        "[balls.small]\ncount = 80\ndiameter = 3 mm\ndensity = 6000 kg/m^3\n",
    )
    + "impacts = all\n[wear]\narchard = 1e-5\nhardness = 8 GPa\n[wear.ball_blade]\nerosion = 1e-12 kg/J\n"
    "[powder]\nmass = 20 g\ndensity = 4000 kg/m^3\nsize = 50 um\nthreshold = 0.015625 mJ\n"
)
EDGE = 2.0**-6 * 1e-3  # [J] an edge of the bins


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A run of two sizes of balls with every impact; no ball is pinched."""
    folder = tmp_path_factory.mktemp("dose")
    (folder / "deck.ini").write_text(MIXED)
    subprocess.run([PROGRAM, "-q", "deck.ini", "-o", "run.h5"], cwd=folder, check=True, capture_output=True)
    return folder / "run.h5"


@pytest.fixture
def run(path):
    with Run(path) as opened:
        assert int(opened.read("run/pinch_contacts")) == 0
        yield opened


@pytest.fixture
def log(run):
    """Columns of the impacts in the window, with the reduced mass [kg] and the mass of the ball."""
    names = ("time", "kind", "ball", "partner", "position", "normal_speed", "tangential_speed", "dissipation")
    found = {name: run.read(f"impacts/{name}") for name in names}
    inside = (found["time"] >= run.window[0]) & (found["time"] < run.window[1])
    found = {name: values[inside] for name, values in found.items()}
    mass = run.balls("mass").astype(float)
    one, pair = mass[found["ball"]], found["kind"] == 0
    other = np.where(pair, mass[np.where(pair, found["partner"], 0)], 1.0)
    return types.SimpleNamespace(**found, mass=one, reduced=np.where(pair, one * other / (one + other), one))


SETS = (
    "powder.law=threshold", "powder.coefficient=2", "heat.ball_heat_capacity=500 J/(kg K)", "heat.jar_mass=4 kg",
    "heat.powder_heat_capacity=800 J/(kg K)", "heat.jar_heat_capacity=500 J/(kg K)", "heat.ball_to_jar=5 W/K",
    "heat.jar_to_room=10 W/K", "heat.room=300 K", "heat.share=0.5",
)  # fmt: skip


def test_every_row_is_that_of_the_log(run, log):
    """Value, error and unit; what the bins of the file round is within 0.5 %."""
    found = {row.name: row for row in dose.rows(run, SETS)}
    energy, each = log.reduced * log.normal_speed**2 / 2, 1 / run.duration
    hard, balls = energy >= EDGE, float(run.balls("mass").sum())
    size = run.balls("diameter").astype(float)[[log.ball, np.where(log.kind == 0, log.partner, 0)]] / 2
    radius = np.where(log.kind == 0, size.prod(axis=0) / size.sum(axis=0), size[0])
    each_radius = 2 * math.pi * (50e-6) ** 2 * 0.6 * 4000
    cut = sums.carrying(run, 0.9)
    counted = energy >= cut
    assert energy[counted].sum() == pytest.approx(0.9 * energy.sum(), rel=0.02)
    caught = each_radius * radius[counted].sum() * each
    drive, error, _ = run.known("rotor_power")
    lost, doubt = log.dissipation.sum() * each, float(run.statistic("precision/dissipated_power/all/standard_error"))
    expected = {
        "power of the drive": (drive, error, "W"),
        "power": (lost, doubt, "W"),
        "power per ball mass": (drive / balls, error / balls, "W/kg"),
        "ball to powder": (balls / 0.02, math.nan, ""),
        "dose rate": (lost / 0.02, doubt / 0.02, "W/kg"),
        "dose in an hour": (3600 * lost / 0.02, 3600 * doubt / 0.02, "J/kg"),
        "stress frequency": (counted.sum() * each, None, "/s"),
        "mean stress energy": (energy[counted].mean(), None, "J"),
        "hard impacts": (hard.sum() * each, None, "/s"),
        "hard impacts per joule": (hard.sum() * each / drive, run.known("hard_per_joule")[1], "/J"),
        "power of hard impacts": (energy[hard].sum() * each, None, "W"),
        "powder caught": (caught, None, "kg/s"),
        "stress number rate": (caught / 0.02, None, "/s"),
        "rate of the law": (2 * hard.sum() * each, 2 * found["hard impacts"].error, "/s"),
    }
    heat = laws.Heat(lost, balls, 0.02, HEATING)
    for column, name in enumerate(("balls", "jar")):
        for when, at in (*((f"after {m} min", heat.after(60 * m)) for m in (1, 10, 60)), ("in the end", heat.steady())):
            expected[f"{name} {when}"] = (at[column], (at[column] - 300) * doubt / lost, "K")
    assert list(found) == list(expected)
    for name, (value, error, unit) in expected.items():
        row, rounds = found[name], "stress" in name or "power of hard" in name or "caught" in name
        assert (row.unit, row.value) == (unit, pytest.approx(value, rel=2e-2 if rounds else 1e-9)), name
        assert 0 < row.error < row.value if error is None else row.error == pytest.approx(error, nan_ok=True), name


@pytest.mark.parametrize(
    "row, text",
    [
        (dose.Row("", 5530.0, 123.0, "W/kg", "", ("W/g", 1e3)), "5.53 ± 0.12 W/g"),
        (dose.Row("", 0.0, math.nan, "kg/s", "", ("g/s", 1e-3)), "0.000 g/s"),
        (dose.Row("", 1234.5, math.nan, "J/kg", "", ("kJ/g", 1.0)), "1234 kJ/g"),
        (dose.Row("", 321.5, 24.6, "K", ""), "322 ± 25 K"),
        (dose.Row("", 0.0123, 0.001, "W", ""), "12.30 ± 1.00 mW"),
    ],
)
def test_a_row_has_the_digits_of_its_error_and_the_unit_of_the_trade(row, text):
    assert dose.measured(row) == text


@pytest.mark.parametrize("sort", sums.SORTS)
def test_a_sum_of_any_function_is_that_of_the_log_in_the_bins_of_the_file(run, log, sort):
    half = log.reduced / 2
    energy = {
        "normal": half * log.normal_speed**2,
        "total": half * (log.normal_speed**2 + log.tangential_speed**2),
        "dissipated": log.dissipation,
    }[sort]
    edges = run.read("statistics/energies/edges")
    count, _ = np.histogram(energy, edges[1:-1])
    inner = np.log(edges[1:-1])
    points = np.exp(inner[:-1, None] + np.diff(inner)[:, None] * (np.arange(8) + 0.5) / 8)
    found = sums.total(run, lambda e, pair: e**1.5, sort)
    assert found.value == pytest.approx(count @ np.mean(points**1.5, axis=1) / run.duration, rel=1e-12)
    # and the bins cost little
    assert found.value == pytest.approx(np.sum(np.maximum(energy, 0) ** 1.5) / run.duration, rel=5e-3)


def test_an_error_of_a_sum_is_the_error_that_the_engine_computes(run):
    for kind in (*run.kinds, None):
        found = sums.total(run, sums.every, kinds=None if kind is None else [kind])
        value, error, _ = run.known(f"rate/{kind or 'all'}")
        assert found.value == pytest.approx(value, rel=1e-12)
        assert found.error == pytest.approx(error, rel=1e-9, nan_ok=True)


@pytest.mark.parametrize(
    "x, period, share",
    [
        ([-1, 1] * 18, 0, 1),
        (range(37), 0, 1),
        ([1] * 12 + [-1] * 12 + [1] * 12 + [-1] * 12, 12, 0.75),
        (range(36), 1, 1),
    ],
)
def test_the_error_of_a_series_is_that_of_eight_pieces(x, period, share):
    x = np.array(x, float)
    error, freedom = sums.spread(x, period)
    ends = [k * len(x) // 8 for k in range(9)]
    pieces = np.array([x[a:b].mean() for a, b in zip(ends, ends[1:])])
    assert freedom == 7
    assert error == pytest.approx(
        pieces.std(ddof=1) / math.sqrt(8 * share) * stdtrit(7, 0.975) / ndtri(0.975), rel=1e-4
    )


def test_the_error_of_a_series_that_only_repeats_is_that_of_its_incomplete_period():
    x = np.array([3 * (k % 12 == 0) for k in range(40)], float)
    assert sums.spread(x, 12) == (pytest.approx(abs(4 * 3 / 40 - 3 / 12)), math.inf)


def test_the_error_of_starts_is_their_scatter_with_students_t():
    x = np.array([3.0, 1.0, 4.0, 1.0, 5.0])
    error, freedom = sums.spread(x, sums.APART)
    wanted = x.std(ddof=1) / math.sqrt(5) * stdtrit(4, 0.975) / ndtri(0.975)
    assert (error, freedom) == (pytest.approx(wanted, rel=1e-3), 4)


@pytest.mark.parametrize("n, period", [(35, 0), (35, 12), (71, 24), (3, sums.APART)])
def test_too_few_blocks_or_starts_have_no_error(n, period):
    error, freedom = sums.spread(np.arange(n) * 1.0, period)
    assert math.isnan(error) and freedom == 0


def test_what_few_starts_have_seen_has_no_error_also_per_joule(run):
    for series, known in (([53.0, 0, 17, 0], False), ([53.0, 40, 47, 50], True)):
        hard = sums.Sum(30.0, np.array(series), sums.APART, 1.0, 100)
        lost = sums.Sum(5.0, np.array([5.0, 5.1, 4.9, 5.0]), sums.APART, 0.1)
        assert math.isfinite(hard.error) == math.isfinite(hard.over(lost)[1]) == known


def test_a_ratio_of_equal_sums_has_no_error(run):
    found = sums.total(run, sums.itself)
    assert found.over(found)[:2] == (1.0, 0.0)


@pytest.mark.slow
def test_stress_frequency_and_energy_do_not_hang_on_the_rebound_floor(tmp_path):
    found = []
    for floor in ("5 mm/s", "30 mm/s"):
        sets = ("run.time=1 s", "run.sample_from=0.4 s", f"contact.rebound_floor={floor}", "output.frames=0 s")
        words = [word for one in sets for word in ("-s", one)]
        path = tmp_path / "a.h5"
        subprocess.run(
            [PROGRAM, "-q", "-f", *words, "-o", path, ROOT / "input/attritor.ini"], check=True, capture_output=True
        )
        with Run(path) as run:
            told = {row.name: row.value for row in dose.rows(run)}
            found.append((told["stress frequency"], told["mean stress energy"], sums.total(run, sums.every).value))
    (frequency, energy, every), (other, another, less) = found
    assert less < 0.7 * every
    assert (other, another) == pytest.approx((frequency, energy), rel=0.1)


# ---- formulas by hand


def powder(**changes):
    return types.SimpleNamespace(
        **{
            "density": 4000.0, "size": 1e-4, "packing": 0.5, "capture": "monolayer", "layer": 1e-4, "modulus": 1e11,
            "law": "none", "coefficient": 3.0, "exponent": 2.0, "threshold": 1e-3, "strength": 1.0, "least": 0.1,
        }
        | changes
    )  # fmt: skip


ONE = np.array([1e-3])


def test_a_monolayer_and_a_volume_of_powder_by_hand():
    # 2 pi 0.002 1e-8 0.5 4000 = 2.513e-7 kg, and half of it
    assert laws.captured(ONE, 2e-3, powder())[0] == pytest.approx(2.5132741e-7, rel=1e-7)
    assert laws.captured(ONE, 2e-3, powder(capture="volume"))[0] == pytest.approx(1.2566371e-7, rel=1e-7)


def test_a_layer_on_the_contact_of_hertz_by_hand():
    # Hertz: E = 8/15 E* sqrt(R) d^2.5; at d = 10 um, R = 4 mm, E* = 1e11 Pa that is 1.06667e-2 J
    energy = np.array([8 / 15 * 1e11 * math.sqrt(4e-3) * (1e-5) ** 2.5])
    found = laws.captured(energy, 4e-3, powder(capture="layer"))
    assert found[0] == pytest.approx(math.pi * 4e-3 * 1e-5 * 1e-4 * 0.5 * 4000, rel=1e-12)


def test_power_law_and_threshold_by_hand():
    energy = np.array([0.5e-3, 1e-3, 2e-3])
    assert laws.effect(energy, 1, powder(law="power")) == pytest.approx([0.75e-6, 3e-6, 12e-6])
    assert laws.effect(energy, 1, powder(law="threshold")) == pytest.approx([0, 3, 3])
    table = powder(law="table", rates=(np.array([1e-3, 3e-3]), np.array([1.0, 2.0])))
    assert laws.effect(energy, 1, table) == pytest.approx([1, 1, 1.5])


def test_breakage_after_vogel_and_peukert_by_hand():
    # 1 mJ on 1e-7 kg: W = 1e4 J/kg, x W = 1 J m/kg; 1 - exp(-(1 - 0.1)) = 0.59343; 1e-7 kg are 47.7465 particles
    stuff = powder()
    assert laws.broken(ONE, np.array([1e-7]), stuff)[0] == pytest.approx(47.7465 * 0.593430, rel=1e-5)
    assert laws.broken(1e-2 * ONE, np.array([1e-7]), powder(least=0.02))[0] == 0  # below the least energy


HEATING = types.SimpleNamespace(
    ball_heat_capacity=500.0, powder_heat_capacity=800.0, jar_heat_capacity=500.0, jar_mass=4.0, ball_to_jar=5.0,
    jar_to_room=10.0, room=300.0, share=0.5,
)  # fmt: skip


def test_temperatures_in_the_end_by_hand():
    # all 100 W leave through the jar: 10 K; half of them come from the balls: 10 K more
    assert laws.Heat(100.0, 2.0, 0.25, HEATING).steady() == pytest.approx([320, 310])


def test_temperatures_go_from_the_room_to_the_end_as_the_equations_say():
    heat = laws.Heat(100.0, 2.0, 0.25, HEATING)  # capacities 1200 and 2000 J/K
    assert heat.after(0.0) == pytest.approx([300, 300])
    assert heat.after(1e6) == pytest.approx(heat.steady())
    step = 1e-3
    rate = (heat.after(60 + step) - heat.after(60 - step)) / (2 * step)
    balls, jar = heat.after(60.0)
    assert rate[0] == pytest.approx((50 - 5 * (balls - jar)) / 1200, rel=1e-6)
    assert rate[1] == pytest.approx((50 + 5 * (balls - jar) - 10 * (jar - 300)) / 2000, rel=1e-6)


def test_a_closed_jar_warms_without_end():
    closed = types.SimpleNamespace(**vars(HEATING) | {"jar_to_room": 0.0})
    heat = laws.Heat(100.0, 2.0, 0.25, closed)
    assert np.isinf(heat.steady()).all()
    assert heat.capacity @ (heat.after(3600.0) - 300) == pytest.approx(100 * 3600)


# ---- wear


def test_wear_of_each_part_is_that_of_the_log(run, log):
    found = Wear(run)
    kinds = list(run.attribute("impacts/kind", "kinds"))
    power = (found["normal_power"] + found["sliding_power"]) * found.area
    for k, part in enumerate(found.parts):
        own = (log.kind == kinds.index(part.kind)) & (log.partner == part.number)
        assert found["count"][found.part == k].sum() == own.sum() > 0 or part.kind == "ball_shaft"
        expected = log.dissipation[own].sum() / run.duration
        assert power[found.part == k].sum() == pytest.approx(expected, rel=1e-12, abs=1e-15)


def test_wear_along_the_drum_is_that_of_the_log(run, log):
    found = Wear(run)
    drum = next(k for k, part in enumerate(found.parts) if part.kind == "ball_drum")
    cells = found.cells[found.part[found.cells[:, 0]] == drum]
    low, high = found.parts[drum].boxes(cells)
    edges = np.unique(np.round(np.concatenate([low[:, 0], high[:, 0]]), 12))
    per_facet = np.bincount(cells[:, 0], minlength=len(found.area))
    counts = np.zeros(len(edges) - 1)
    np.add.at(counts, cells[:, 1], found["count"][cells[:, 0]] / per_facet[cells[:, 0]])
    x = log.position[log.kind == 1, 0]
    assert len(edges) > 8
    assert counts == pytest.approx(np.histogram(x, edges)[0], abs=2)  # places of the log have single precision


def test_finnies_mass_is_that_of_the_log(run, log):
    found = Wear(run)
    blades = np.isin(found.part, [k for k, part in enumerate(found.parts) if part.kind == "ball_blade"])
    own = log.kind == 4
    n, t, mass = log.normal_speed[own], log.tangential_speed[own], log.mass[own]
    removed = 1e-12 * np.sum(mass * np.where(3 * n < t, 2 * n * t - 3 * n**2, t**2 / 3))
    assert (found["finnie_rate"] * found.area)[blades].sum() * run.duration == pytest.approx(removed, rel=1e-12)
    assert np.isnan(found["finnie_rate"][~blades]).all()


def test_archards_depth_is_at_most_that_of_all_sliding(run):
    found = Wear(run)
    most = 1e-5 / (0.3 * 8e9) * found["sliding_power"]
    assert (found["archard_rate"] <= most * (1 + 1e-12)).all()
    assert np.isclose(found["archard_rate"], most, rtol=1e-12)[most > 0].mean() > 0.2  # most impacts slide to the end


@pytest.mark.slow
def test_the_mesh_shows_the_parts_as_they_are_at_the_start_with_the_values_of_their_facets(run):
    found, mesh = Wear(run), lambda name: run.read(f"statistics/wear/mesh/{name}")
    corners, facet = mesh("points").reshape(-1, 3, 3).astype(float), mesh("facet")
    assert mesh("triangles") == len(corners) == len(facet)
    for name in ("rate", "normal_power", "sliding_power", "archard_rate", "finnie_rate"):
        assert mesh(name) == pytest.approx(found[name][facet], rel=1e-6, nan_ok=True)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    pose = np.array([part.start for part in found.parts])[found.part]
    centre = np.einsum("ijk,ik->ij", pose[..., :3], found["centre"]) + pose[..., 3]
    for k, part in enumerate(found.parts):
        own, shown = found.part == k, found.part[facet] == k
        assert area[shown].sum() == pytest.approx(found.area[own].sum(), rel=1e-5)
        middle = found.area[own] @ centre[own] / found.area[own].sum()
        assert area[shown] @ corners[shown].mean(axis=1) / area[shown].sum() == pytest.approx(middle, abs=1e-6)
        angle = math.radians(20) if part.motion else 0
        assert part.start[1:, 1:3] == pytest.approx(
            np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        )
        assert (part.motion, part.round) == (
            "rotor" * (part.kind in ("ball_shaft", "ball_blade")), part.kind != "ball_blade"
        )  # fmt: skip
    assert [(part.kind, part.number) for part in found.parts] == [
        ("ball_drum", -1), ("ball_wall", 0), ("ball_wall", 1), ("ball_shaft", -1), ("ball_blade", 0), ("ball_blade", 1),
    ]  # fmt: skip
    for part, side in zip(found.parts[4:], (1, -1)):
        assert part.axes == pytest.approx(np.column_stack([np.diag([1, side, side]), [-0.01 * side, 0.011 * side, 0]]))


def test_the_densest_face_of_a_part_has_a_thousandth_of_its_power():
    rest = dict.fromkeys([f.name for f in dataclasses.fields(wear.Face)][3:], 0.0)
    for small, densest in ((1.05e-3, "tip"), (0.95e-3, "side")):
        side, tip = (
            wear.Face("blade", name, **rest | {"area": size, "sliding": power})
            for name, size, power in (("side", 1.0, 1 - small), ("tip", 1e-6, small))
        )
        ((whole, top),) = wear.parts([tip, side])
        assert (whole.area, whole.power, top.face) == (1 + 1e-6, pytest.approx(1), densest)


def test_faces_add_up_to_the_parts(run):
    faces, found = wear.faces(run), Wear(run)
    assert sum(face.power for face in faces) == pytest.approx(
        ((found["normal_power"] + found["sliding_power"]) * found.area).sum()
    )
    assert {face.face for face in faces if face.part.startswith("blade")} >= {"leading", "tip"}
    assert sum(face.rate for face in faces) == pytest.approx((found["rate"] * found.area).sum())
    assert wear.finding(faces).startswith(f"{faces[0].part}, {faces[0].face}, takes ")
    few = [dataclasses.replace(face, peak=0.0) for face in faces]  # too few impacts on each spot
    assert wear.finding(few).endswith(" % of the power that reaches the parts")


# ---- the commands


@pytest.mark.slow
def test_values_can_be_given_for_a_run_without_powder_and_its_notes_are_repeated(mill, small_deck, tmp_path):
    subprocess.run([PROGRAM, "-q", "deck.ini", "-o", "a.h5"], cwd=tmp_path, check=True, capture_output=True)
    found = mill("dose", "a.h5", "-s", "powder.mass=20 g", "-s", "powder.density=4000 kg/m^3", "--json")
    results = json.loads(found.stdout)["results"]
    power = results["power"]["value"]
    assert results["dose rate"] == pytest.approx({**results["dose rate"], "value": power / 0.02})
    assert found.stderr.startswith("mill dose: note: not steady: the rotor's power")
    assert mill("wear", "a.h5").stderr == found.stderr.replace("dose", "wear")
    bare = json.loads(mill("dose", "a.h5", "--json").stdout)["results"]
    assert "dose rate" not in bare and bare["hard impacts"]["meaning"].endswith(
        " or more, which lose half of the energy"
    )


@pytest.mark.parametrize(
    "sets, words",
    [
        (["powder.mass=20"], "powder.mass=20: [powder] mass: expected a mass with its unit such as"),
        (["powder.mass=20 g"], "needs [powder] density"),
        (["drum.radius=3 m"], "only keys of [powder] and [heat] can be set"),
        (["powder.law=power", "powder.coefficient=1"], "needs [powder] exponent"),
        (["powder.law=power", "powder.exponent=1"], "needs [powder] coefficient"),
        (["powder.law=threshold"], "needs [powder] coefficient"),
        (["powder.law=table"], "needs [powder] table"),
        (["powder.law=vogel_peukert"], "needs [powder] strength"),
        (["powder.law=vogel_peukert", "powder.size=0 m", "powder.strength=1 kg/(J m)"], "needs [powder] size"),
        (["powder.capture=layer"], "needs [powder] layer"),
        (["heat.jar_mass=2 kg"], "needs [heat] ball_heat_capacity"),
    ],
)
def test_a_wrong_or_missing_value_is_told(run, sets, words):
    if "needs [powder] density" in words:
        run.as_deck.sections["powder"] = {}
    with pytest.raises(UserError, match=words.replace("[", r"\[").replace("]", r"\]")):
        dose.rows(run, sets)


def test_mill_wear_prints_a_line_for_each_part_and_then_its_faces(mill, path, run):
    lines = mill("wear", str(path), "--faces").stdout.splitlines()
    assert "takes" in lines[0]
    assert [line for line in lines if len(line) > 80] == []
    first, second = (k for k, line in enumerate(lines) if line.startswith("part"))
    heads = lines[first].split()
    assert heads == ["part", "normal", "sliding", "share", "densest", "depth", "deepest", "eroded"]
    assert lines[first + 1].split() == ["W", "W", "%", "kW/m²", "mm/year", "mm/year", "mg/h"]
    parts = {face.part for face in wear.faces(run)}
    assert len([line for line in lines[first + 2 : second] if line.strip()]) == len(parts) > 4
    assert len([line for line in lines[second + 2 :] if line.startswith("blade 0")]) > 1
    assert "face" not in mill("wear", str(path)).stdout.splitlines()[3].split()


def test_the_line_of_a_part_is_the_sum_of_its_faces(mill, path):
    found = json.loads(mill("wear", str(path), "--json").stdout)
    for part in found["parts"]:
        own = [face for face in found["faces"] if face["part"] == part["part"]]
        for key in ("area", "rate", "normal", "sliding"):
            assert part[key] == pytest.approx(sum(face[key] for face in own))
        assert part["depth"] * part["area"] == pytest.approx(
            sum(face["depth"] * face["area"] for face in own), rel=1e-9, abs=0
        )
        assert part["densest"] == pytest.approx(max(face["sliding"] / face["area"] for face in own))
    assert sum(part["share"] for part in found["parts"]) == pytest.approx(1)


def test_depths_and_masses_with_other_coefficients_are_those_of_a_run_with_them(run, millsim, write_deck, tmp_path):
    other = ["wear.archard=3e-5", "wear.ball_drum.hardness=2 GPa", "wear.ball_blade.erosion=5e-12 kg/J"]
    write_deck(MIXED)
    assert millsim("deck.ini", "-q", "-o", "b.h5", *(word for one in other for word in ("-s", one))).returncode == 0
    asked = wear.faces(run, other)
    with Run(tmp_path / "b.h5") as again:
        ran = wear.faces(again)
    for key in ("depth", "deepest", "erosion"):
        values, expected = ([getattr(face, key) for face in some] for some in (asked, ran))
        assert values == pytest.approx(expected, rel=1e-9, abs=0, nan_ok=True) and np.isfinite(values).any()
        assert values != pytest.approx([getattr(face, key) for face in wear.faces(run)], rel=1e-9, abs=0, nan_ok=True)


@pytest.mark.slow
def test_a_run_without_coefficients_gets_depths_and_masses_of_a_run_with_them(mill, run, millsim, write_deck, tmp_path):
    given = ["wear.archard=1e-5", "wear.hardness=8 GPa", "wear.ball_blade.erosion=1e-12 kg/J"]
    write_deck(MIXED[: MIXED.index("[wear]")])
    assert millsim("deck.ini", "-q", "-o", "a.h5").returncode == 0
    assert f"For depths add coefficients: {wear.SUCH_AS}" in mill("wear", "a.h5").stdout
    with Run(tmp_path / "a.h5") as opened:
        for one, other in zip(wear.faces(opened, given), wear.faces(run), strict=True):
            (*names, rest), (*others, expected) = ((f.part, f.face, dataclasses.astuple(f)[2:]) for f in (one, other))
            assert names == others and rest == pytest.approx(expected, rel=1e-9, abs=0, nan_ok=True)


@pytest.mark.parametrize(
    "sets, words",
    [
        (["wear.ball_drum.archard=0"], "needs both wear.archard and wear.hardness: add -s wear.archard=1e-4"),
        (["wear.ball_jar.hardness=1 GPa"], r"\[wear.ball_jar\]: no part of this mill has this kind of contact: one of"),
        (["powder.mass=1 g"], r"only keys of \[wear\] can be set"),
        (["wear.hardness=2"], "hardness: expected a pressure with its unit"),
    ],
)
def test_a_wrong_coefficient_of_wear_is_told(run, sets, words):
    with pytest.raises(UserError, match=words):
        wear.faces(run, sets)


def test_a_small_rate_has_characters_that_a_terminal_shows():
    said = dose.measured(dose.Row("rate of the law", 1.5934e-8, 3e-10, "/s", ""))
    assert said == "1.593 ± 0.030 × 10⁻⁸ /s" and said.isprintable()


def test_the_finding_is_told_in_lines_of_eighty(path, monkeypatch):
    said = f"{'a' * 40} {'b' * 40}"
    monkeypatch.setattr(wear, "finding", lambda _: said)
    text = wear.run(
        types.SimpleNamespace(run=path, set=[], faces=False, **dict.fromkeys(("worn", "after", "removed", "density")))
    ).text
    assert text.startswith(said.replace(" ", "\n") + "\n\n")


def test_a_part_names_the_motion_that_carries_it(path):
    with h5py.File(path) as file:
        parts = file["statistics/wear/parts"]
        kind = parts["kind"].attrs["kinds"][parts["kind"][:]]
        assert list(parts["motion"].attrs["motions"]) == ["rotor"]
        assert np.array_equal(parts["motion"][:] == 0, np.isin(kind, ["ball_blade", "ball_shaft"]))


# ---- intervals of spectra


@pytest.mark.parametrize("kind", ["ball_ball", "ball_drum", "all"])
def test_the_errors_of_a_spectrum_are_those_of_the_sums_over_its_bins(run, kind):
    kinds = None if kind == "all" else [kind]
    edges = run.read("statistics/energies/blocks/edges")[60:240:20]
    within, above = sums.errors(run, edges, kind), sums.errors(run, edges, kind, above=True)
    assert (len(within), len(above)) == (len(edges) - 1, len(edges))
    for k, (low, high) in enumerate(zip(edges, edges[1:])):
        between = sums.total(run, lambda e, pair, low=low, high=high: (e >= low) & (e < high), kinds=kinds)
        assert within[k] == pytest.approx(between.error, rel=0.02, nan_ok=True)
        assert above[k] == pytest.approx(sums.total(run, sums.above(low), kinds=kinds).error, rel=0.02, nan_ok=True)
    assert np.isfinite(within).sum() >= 3


@pytest.mark.parametrize("weight", spectra.WEIGHTS)
def test_a_spectrum_has_the_interval_of_its_blocks_around_its_line(run, weight):
    ax = Canvas().subplots()
    line = spectra.plot(ax, run, abscissa="energy", weight=weight, kinds="ball_ball")[0]
    found = spectra.bins(run, "ball_ball", abscissa="energy")
    rate = found.exceedance if weight == "cumulative" else found.count / found.duration
    part = 1.96 * sums.errors(run, found.edges, "ball_ball", weight == "cumulative")[rate > 0] / rate[rate > 0]
    (band,) = [one for one in ax.collections if one.get_label() == "_band"]
    corners = np.concatenate([path.vertices for path in band.get_paths()])
    x, y = (values[rate > 0] for values in line.get_data())
    known = np.isfinite(part * y)
    assert known.sum() > 10
    for place, value, half in zip(x[known], y[known], part[known]):
        ends = corners[np.isclose(corners[:, 0], place, rtol=1e-9, atol=0), 1]
        low = 1 - half if weight == "energy" else max(1 - half, 1e-3)  # above 0 on a logarithmic axis
        assert sorted([ends.min(), ends.max()]) == pytest.approx(sorted([value * low, value * (1 + half)]))


def test_a_file_without_blocks_has_spectra_without_intervals(path, tmp_path):
    shutil.copy(path, tmp_path / "old.h5")
    with h5py.File(tmp_path / "old.h5", "r+") as file:
        del file["statistics/energies/blocks"]
    ax = Canvas().subplots()
    for name, told in ((path, True), (tmp_path / "old.h5", False)):
        with Run(name) as opened:
            assert ("95 %" in FIGURES["energies"].says([opened])) is told
    with Run(tmp_path / "old.h5") as opened:
        spectra.plot(ax, opened, abscissa="energy")
    assert not [one for one in ax.collections if one.get_label() == "_band"]


# ---- the figure of wear


def test_faces_of_one_name_are_drawn_beside_each_other(millsim, write_deck, tmp_path):
    jar = "[body.jar]\nshape = cylinder\nside = inside\nradius = 30 mm\nlength = 40 mm\n"
    deck = re.sub(r"\[drum\].*?(?=\[contact\])", jar, SMALL, flags=re.S)
    write_deck(deck)
    assert millsim("deck.ini", "-q", "-s", "balls.speed=1 m/s").returncode == 0
    with Run(tmp_path / "deck.h5") as opened:
        names = [ax.get_title(loc="left") for ax in FIGURES["wear"].draw(opened).axes]
    assert len([name for name in names if "jar" in name]) >= 3


def test_a_picture_of_wear_names_its_axes_its_unit_and_which_of_equal_parts_it_shows(run):
    figure = FIGURES["wear"].draw(run)
    axes = {ax.get_title(loc="left"): ax for ax in figure.axes}
    leading = next(ax for name, ax in axes.items() if re.match(r"blade \d, leading \(most of \d blades\)", name))
    assert (leading.get_xlabel(), leading.get_ylabel()) == ("from the axis [mm]", "width [mm]")
    tip = run.as_deck.blades[0].tip_radius
    assert leading.dataLim.intervalx == pytest.approx([0, 1e3 * tip], abs=1e-6)
    bar = next(ax for ax in figure.axes if "power" in ax.get_ylabel())
    assert bar.get_ylabel() == "power lost by sliding [kW/m²]; grey: no impacts"
    found = Wear(run)
    (cells,) = leading.collections
    assert np.nanmax(cells.get_array()) == pytest.approx(1e-3 * found["sliding_power"][found.face >= 4].max())
    assert np.array_equal(cells.cmap(range(256)), colour.MAPS["speeds"](range(256)))


def test_the_worst_spot_is_the_facet_with_the_most_sliding_and_has_the_end_of_the_scale(run, monkeypatch):
    found, faces = Wear(run), wear.faces(run)
    most = found["sliding_power"][found["count"] >= wear.ENOUGH].max()
    worst = max(faces, key=lambda face: face.peak)
    assert worst.peak == most and f"at a spot of {worst.part}, {worst.face}: " in wear.finding(faces)
    assert limits([found], "sliding_power")[1] == most
    monkeypatch.setattr(wear, "ENOUGH", int(found["count"][np.argmax(found["sliding_power"] == most)]))
    assert max(face.peak for face in wear.faces(run)) == most


@pytest.mark.slow
def test_labels_of_flat_panels_do_not_overlap(run):
    figure = FIGURES["wear"].draw(run)
    figure.draw_without_rendering()
    flat = [ax for ax in figure.axes if ax.get_ylabel() in ("width [mm]", "thickness [mm]")]
    for ax in flat:
        boxes = [label.get_window_extent() for label in ax.get_yticklabels()]
        seen = sorted((box.y0, box.y1) for box in boxes if ax.bbox.y0 - 9 <= (box.y0 + box.y1) / 2 <= ax.bbox.y1 + 9)
        assert len(seen) >= 2 and all(below[1] <= above[0] for below, above in zip(seen, seen[1:]))
    assert len(flat) >= 2
