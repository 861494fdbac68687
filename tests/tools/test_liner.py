"""The liner of a tumbling mill: sums along its contour and around its axis against the log of all impacts; worn
contours; the life of a liner."""

import csv
import json
import math
import subprocess

import layouts
import numpy as np
import pytest
from conftest import PROGRAM, once

from milltools.base.errors import UserError
from milltools.base.text import number
from milltools.dose import liner, wear
from milltools.dose.liner import Liner, Turn
from milltools.figures import FIGURES
from milltools.figures.charge import View
from milltools.geometry.contour import Contour
from milltools.read.runfile import Run
from milltools.study.life import Life
from milltools.study.plan import job
from milltools.study.show.data import Scale

DRUM = """\
[run]
time = 1.2 s
sample_from = 0.4 s
starts = 1
[motion.roll]
kind = turn
axis = 1 0 0
speed = 70 % critical
[drum]
diameter = 200 mm
length = 60 mm
ends = periodic
profile = lifters
lifters = 6
lifter_height = 10 mm
lifter_width = 10 mm
lifter_front = 20 deg
lifter_back = 10 deg
lifter_rounding = 2 mm
motion = roll
[balls]
bulk_fill = 20 %
diameter = 18 mm
density = 7800 kg/m^3
[contact]
restitution = 0.6
friction = 0.3
tangential_restitution = 0.4
[wear]
archard = 1e-4
hardness = 2 GPa
[output]
frames = 0 s
impacts = all
"""
ROUND = DRUM[: DRUM.index("profile")] + DRUM[DRUM.index("motion = roll\n[balls]") :]
LIFE = """\
[study]
deck = drum.ini
record = power
[life]
steps = 2
removed = 4 %
[set]
run.time = 0.8 s
output.impacts = statistics
"""


def simulate(folder, deck, name="a", *sets):
    (folder / f"{name}.ini").write_text(deck)
    orders = [word for one in sets for word in ("-s", one)]
    subprocess.run([PROGRAM, "-q", "-o", f"{name}.h5", *orders, f"{name}.ini"], cwd=folder, check=True)
    return folder / f"{name}.h5"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return once(tmp_path_factory, "liner", lambda folder: simulate(folder, DRUM)) / "a.h5"


@pytest.fixture
def run(path):
    with Run(path) as opened:
        yield opened


def log(run):
    """Of the impacts on the drum after the start of the window: times, places across (n, 2) [m] in the laboratory."""
    kind, time = run.read("impacts/kind"), run.read("impacts/time")
    own = (kind == run.index_names("impacts/kind").index("ball_drum")) & (time >= run.window[0])
    return own, time[own], run.read("impacts/position")[own][:, 1:]


# ---- along the contour


@pytest.mark.slow
def test_each_impact_is_counted_at_its_developed_length(run):
    own, time, place = log(run)
    found = Liner(run)
    angle = -found.turning * run.quantity("motion.roll/speed") * time
    turned = np.stack([np.cos(angle) * place[:, 0] - np.sin(angle) * place[:, 1],
                       np.sin(angle) * place[:, 0] + np.cos(angle) * place[:, 1]], axis=1)  # fmt: skip
    bins = len(run.read(f"{liner.ALONG}/count"))
    s = (np.arange(10 * bins) + 0.5) / (10 * bins) * found.contour.length
    spots = found.contour.points(*found.contour.at(s))
    nearest = np.array([np.argmin(((spots - one) ** 2).sum(axis=1)) for one in turned]) // 10
    expected = np.bincount(nearest, weights=run.read("impacts/dissipation")[own], minlength=bins)
    stored = run.read(f"{liner.ALONG}/normal") + run.read(f"{liner.ALONG}/sliding")
    ends = np.linspace(0, bins, 201).astype(int)
    near = [np.add.reduceat(one, ends[:-1]) for one in (expected, stored)]
    # an impact at the end of a bin may be in its neighbour
    assert np.abs(np.cumsum(near[0] - near[1])).max() < 0.02 * expected.sum()
    assert stored.sum() == pytest.approx(expected.sum(), rel=1e-9)


def test_all_impacts_on_the_contour_are_on_the_facets_and_along_it(run):
    found = Liner(run)
    assert found.sums("count").sum() == pytest.approx(run.read("statistics/wear/count").sum())
    facets = run.read("statistics/wear/sliding_power") @ run.read("statistics/wear/area")
    assert found.density("sliding").mean() * found.contour.length * found.width == pytest.approx(facets, rel=1e-9)


def test_the_liner_has_its_lifters_height_and_faces(run):
    found = Liner(run)
    assert (found.parts, found.lifters) == (6, 6)
    assert found.height == pytest.approx(0.01, rel=1e-3)
    assert found.front == pytest.approx(math.radians(20), abs=math.radians(0.5))
    assert sum(found.shares("sliding").values()) == pytest.approx(1)


def test_lifters_of_a_lower_set_are_counted(tmp_path):
    deck = DRUM.replace("lifter_height = 10 mm", "lifter_height = 10 mm\nlifter_second_height = 3 mm")
    with Run(simulate(tmp_path, deck, "a", "run.time=0.42 s")) as run:
        assert (Liner(run).lifters, Liner(run).parts) == (6, 3)


@pytest.mark.slow
def test_leading_faces_get_more_than_trailing_ones_and_change_with_the_turning(run, tmp_path):
    deck = DRUM.replace("speed = 70 % critical", "speed = -70 % critical").replace("back = 10", "back = 20")
    with Run(simulate(tmp_path, deck)) as other:
        for found in (Liner(run), Liner(other)):
            shares = found.shares("slid")
            assert shares["leading face"] > 2 * shares["trailing face"]
        assert (Liner(run).turning, found.turning) == (1, -1)


def grooved(shape: Contour) -> Contour:
    """With a groove in each plate, deeper than the plate by 4 % of the radius, in front of a lifter."""
    rows = []
    for k, (x, y, bulge) in enumerate(shape.vertices):
        plate = bool(shape.lengths[k] > 0.03)
        rows.append((x, y, math.tan(0.9 * shape.sweep[k] / 4) if plate else bulge))
        rows += [(*shape.points(k, 0.9), 0), (*(1.04 * shape.points(k, 0.95)), 0)] * plate
    return Contour(rows)


def test_a_groove_makes_neither_the_liner_higher_nor_its_plates_lifters(run, tmp_path):
    (tmp_path / "worn.txt").write_text(grooved(Liner(run).contour).text())
    deck = DRUM[: DRUM.index("profile")] + "profile = file\nfile = worn.txt\n" + DRUM[DRUM.index("motion = roll\n[b") :]
    with Run(simulate(tmp_path, deck)) as worn:
        assert Liner(worn).contour.outermost > 1.03 * Liner(run).contour.outermost
        assert Liner(worn).height == pytest.approx(Liner(run).height, rel=0.02)
        on, new = (Turn(one, 0)["lifter_outward"].sum() / Turn(one, 0)["outward"].sum() for one in (worn, run))
        assert on == pytest.approx(new, abs=0.2) and new < 0.6


@pytest.mark.parametrize("lifters", [1, 7, 33])
def test_equal_parts_of_a_contour_are_counted(lifters):
    rows = []
    for k in range(lifters):
        a, b = 2 * math.pi * k / lifters, 2 * math.pi * (k + 0.1) / lifters
        step = math.tan((2 * math.pi / lifters - (b - a)) / 4)
        rows += [(math.cos(a), math.sin(a), 0), (0.9 * math.cos(a), 0.9 * math.sin(a), 0)]
        rows += [(0.9 * math.cos(b), 0.9 * math.sin(b), 0), (math.cos(b), math.sin(b), step)]
    assert liner.equal_parts(Contour(rows)) == lifters


# ---- around the axis


@pytest.mark.slow
def test_the_force_on_a_smooth_liner_makes_the_torque_of_the_drive(tmp_path):
    with Run(simulate(tmp_path, ROUND)) as run:
        turn = Turn(run, 0)
        torque = -0.1 * turn["forward"].sum() / turn.duration
        assert torque == pytest.approx(float(run.statistic("motions/roll/torque")), rel=0.02)
        assert turn["lifter_outward"].sum() == 0
        with pytest.raises(UserError, match="only for a container that is a contour"):
            Liner(run)


def test_impacts_are_counted_at_their_angle_after_the_lowest_place(run):
    own, _, place = log(run)
    angle = np.arctan2(place[:, 0] * -Liner(run).turning, -place[:, 1])
    for turned in (angle, -angle):
        count = np.histogram(turned, np.linspace(-math.pi, math.pi, 181))[0]
        if np.abs(count - Turn(run, 6).count).sum() <= 2:
            break
    else:
        pytest.fail("neither to the rising side nor to the falling one")
    assert Turn(run, 6).angle[np.argmax(Turn(run, 6).count)] > -math.pi / 4


def test_lifters_are_pressed_outwards_and_back_in_the_charge(run):
    turn = Turn(run, Liner(run).lifters)
    charge = (turn.angle > 0) & (turn.angle < 1)
    assert turn.outward[charge].mean() > 0 > turn.forward[charge].mean()


def test_the_mean_force_over_a_turn_carries_the_impulse_of_all_lifters(run):
    turn = Turn(run, 6)
    assert 6 * turn.forward.mean() * turn.duration == pytest.approx(turn["lifter_forward"].sum(), rel=1e-9)


def test_one_per_cent_of_the_impulse_comes_from_larger_impacts():
    edges, weight = np.array([1.0, 2.0, 4.0, 8.0]), np.array([0.0, 98.0, 2.0])
    assert liner._quantile(weight, edges) == pytest.approx(4 * math.sqrt(2))
    assert math.isnan(liner._quantile(0 * weight, edges))


def test_the_share_above_the_toe_is_that_of_the_bins_below_its_angle(run):
    turn, (toe, _) = Turn(run, 6), run.charge["toe"]
    below = turn.normal[turn.angle < toe].sum() / turn.normal.sum()
    edge = turn.normal[np.argmin(np.abs(turn.angle - toe))] / turn.normal.sum()
    assert run.charge["above_toe"][0] == pytest.approx(below, abs=edge + 1e-12)
    assert 0 < turn.above_toe < run.charge["above_toe"][0] < 1


# ---- the worn contour


def test_the_worn_contour_has_lost_exactly_depths_times_lengths(run):
    found = Liner(run)
    depth = found.scaled(found.density("slid"), 0.05 * found.height)
    removed = depth.mean() * found.contour.length
    assert found.worn(depth).area - found.contour.area == pytest.approx(removed, rel=1e-9)
    assert found.lost(depth) == pytest.approx(0.05 * found.height)


def test_the_depth_after_a_time_is_that_of_archards_law(mill, path, run):
    hours = 2000
    done = mill("wear", str(path), "--worn", "next.txt", "--after", f"{hours} h", "--json")
    facts = json.loads(done.stdout)["worn"]
    work = run.read(f"{liner.ALONG}/slid").sum() / run.duration * hours * 3600
    volume = 1e-4 / (0.3 * 2e9) * work
    assert facts["removed_area"] * 0.06 == pytest.approx(volume, rel=1e-9)


def test_the_worn_contour_is_one_that_millsim_reads(mill, path, tmp_path):
    assert mill("wear", str(path), "--worn", "next.txt", "--removed", "5 %").returncode == 0
    deck = "".join(line for line in DRUM.splitlines(True) if not line.startswith("lifter"))
    (tmp_path / "b.ini").write_text(deck.replace("profile = lifters", "profile = file\nfile = next.txt"))
    said = subprocess.run([PROGRAM, "--contour", "b.ini"], cwd=tmp_path, capture_output=True, text=True, check=True)
    rows = [line for line in said.stdout.splitlines() if not line.startswith("#")]
    assert len(rows) == len(Contour.read(tmp_path / "next.txt").vertices)


def test_a_large_step_is_told_with_the_number_of_steps_and_a_larger_one_only_made_if_forced(mill, path, tmp_path):
    words = "wear", str(path), "--worn", "a.txt", "--removed"
    done = mill(*words, "30 %")
    assert done.returncode == 2 and not (tmp_path / "a.txt").exists()
    facts = json.loads(mill(*words, "30 %", "--force", "--json").stdout)["worn"]
    assert facts["steps"] == math.ceil(facts["largest_depth"] / facts["height"] / 0.05) > 5
    assert f"make {facts['steps']} steps" in done.stderr
    assert "make 2 steps" in " ".join(mill(*words, "4 %", "--force").stdout.split())
    assert "steps" not in mill(*words, "1 %", "--force").stdout


def test_erosion_takes_a_depth_with_the_density_of_the_liner(run):
    found, sets = Liner(run), ["wear.archard=0", "wear.hardness=0 GPa", "wear.erosion=1e-12 kg/J"]
    rate = wear.depth_rate(found, sets, 7800.0)
    mass = rate.sum() / found.bins * found.contour.length * found.width * 7800
    assert mass == pytest.approx(1e-12 * run.read(f"{liner.ALONG}/carved").sum() / run.duration, rel=1e-9)
    assert np.isnan(wear.depth_rate(found, sets)).all()


@pytest.mark.parametrize(
    "words, said",
    [
        (["--after", "1 h"], "--after: only with --worn NEXT.txt"),
        (["--worn", "n.txt"], "--worn: expected one of --after '1000 h' and --removed '5 %'"),
        (["--worn", "n.txt", "--after", "1 h", "--removed", "1 %"], "--worn: expected one of"),
        (["--worn", "-", "--after", "1 h"], "-: expected the name of a file"),
        (["--worn", "n.txt", "--after", "1 mm"], "--after: expected a time"),
        (["--worn", "n.txt", "--after", "1e9 h"], "--after: must be at most 1000000000 s, got '1e9 h'"),
        (["--worn", "n.txt", "--after=-10h"], "--after: must be 0 or more, got '-10h'"),
        (["--worn", "n.txt", "--removed", "5 mm"], "--removed: expected a share such as '5 %', got '5 mm'"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_before_anything_is_written(mill, path, tmp_path, words, said):
    done = mill("wear", str(path), *words)
    assert done.returncode == 2 and said in done.stderr and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "n.txt").exists()


@pytest.mark.slow
def test_a_depth_after_a_time_needs_coefficients_and_a_share_does_not(mill, tmp_path):
    bare = simulate(tmp_path, DRUM.replace("[wear]\narchard = 1e-4\nhardness = 2 GPa\n", ""))
    done = mill("wear", str(bare), "--worn", "n.txt", "--after", "1 h")
    assert done.returncode == 2 and "without coefficients: add -s wear.archard=1e-4" in done.stderr
    given = ["-s", "wear.archard=1e-4", "-s", "wear.hardness=2 GPa"]
    assert mill("wear", str(bare), "--worn", "n.txt", "--after", "1 h", *given).returncode == 0
    assert mill("wear", str(bare), "--worn", "m.txt", "--removed", "1 %").returncode == 0


@pytest.mark.slow
def test_the_worn_contour_of_a_body_is_told_with_the_key_that_reads_it(mill, tmp_path):
    (tmp_path / "wall.txt").write_text("0.1 0 0\n0 0.1 0\n-0.1 0 0\n0 -0.1 0\n")
    body = "[body.jar]\nshape = contour\nside = inside\nfile = wall.txt\nlength = 60 mm\nmotion = roll\n"
    deck = DRUM[: DRUM.index("[drum]")].replace("70 % critical", "90 rpm").replace("1.2 s", "0.6 s") + body
    jar = simulate(tmp_path, deck + DRUM[DRUM.index("[balls]") :].replace("bulk_fill = 20 %", "count = 60"))
    said = " ".join(mill("wear", str(jar), "--worn", "n.txt", "--removed", "1 %").stdout.split())
    assert "deep. body.jar.file reads it." in said
    (tmp_path / "wall.txt").write_text("0.1 0 1\n-0.1 0 1\n")
    jar = simulate(tmp_path, jar.with_suffix(".ini").read_text(), "b")
    done = mill("wear", str(jar), "--worn", "m.txt", "--removed", "1 %")
    assert done.returncode == 2 and "--removed: a circle has no height" in done.stderr


def test_an_existing_contour_is_kept_unless_forced(mill, path, tmp_path):
    (tmp_path / "n.txt").write_text("mine")
    assert "exists already" in mill("wear", str(path), "--worn", "n.txt", "--removed", "1 %").stderr
    assert (tmp_path / "n.txt").read_text() == "mine"
    assert mill("wear", str(path), "--worn", "n.txt", "--removed", "1 %", "--force").returncode == 0


def test_mill_wear_says_where_the_liner_wears_and_what_is_above_the_toe(mill, path):
    said = " ".join(mill("wear", str(path)).stdout.split())
    assert "Sliding wears the liner most on the " in said and "leading face " in said
    assert said.startswith("drum, inside, takes ") and "faces " not in mill("wear", str(path), "--faces").stdout
    assert "Above the toe are " in said and "A lifter gets the largest mean force" in said


@pytest.mark.slow
def test_the_figure_has_the_numbers_of_the_file(run):
    (table,) = FIGURES["liner"].tables(run)
    found = Liner(run)
    assert table.columns["power lost by sliding [W/m2]"] == pytest.approx(found.density("sliding"))
    figure = FIGURES["liner"].draw(run)
    assert not layouts.faults(figure)
    assert not layouts.faults(FIGURES["liner"].draw([run, run]))
    assert [ax.get_ylabel() for ax in figure.axes] == [
        "power [kW/m²]", "height [mm]", "force on a lifter [N]", "99 % [N s]",
    ]  # fmt: skip


def test_a_contour_of_a_file_throws_balls_by_its_leading_faces(run, monkeypatch):
    own, text = View(run).thrown(), run.text
    monkeypatch.setattr(run, "text", lambda key, *more: "file" if key == "drum/profile" else text(key, *more))
    found = View(run).thrown()
    assert [found.leaves, found.lands] == pytest.approx([own.leaves, own.lands], abs=math.radians(0.5))


# ---- the life


@pytest.fixture
def life(tmp_path):
    (tmp_path / "drum.ini").write_text(DRUM)
    (tmp_path / "life.study").write_text(LIFE)
    return tmp_path


@pytest.mark.slow
def test_each_run_of_a_life_has_the_contour_that_the_one_before_has_left(life, mill):
    done = mill("sweep", "life.study", "-q", "--set", "study.record=power, toe")
    assert done.returncode == 0, done.stderr
    with open(life / "life/life.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    areas = [Contour.read(life / f"life/step-{k}.txt").area for k in range(4)]
    assert [float(row["worn [m2]"]) for row in rows] == pytest.approx([a - areas[0] for a in areas[:3]], rel=1e-6)
    assert [float(row["lost [m]"]) for row in rows] == pytest.approx([0, 0.0004, 0.0008], rel=1e-3)
    assert float(rows[2]["time [s]"]) > float(rows[1]["time [s]"]) > 0  # the deck has coefficients
    assert (life / "life/life.png").exists()
    assert list(rows[0])[-4:] == ["power [W]", "power error [W]", "toe [rad]", "toe error [rad]"]
    heads, units, first = (line.split() for line in done.stdout.splitlines()[:3])
    assert heads[-2:] == ["power", "toe"] and units[-2:] == ["W", "deg"]
    assert float(first[-1]) == pytest.approx(math.degrees(float(rows[0]["toe [rad]"])), abs=0.01)
    tall, stands = (number(1e3 * float(rows[k]["height [m]"])) for k in (0, 2))
    assert f"of {tall} mm the tops have lost 0.8 mm, and the liner stands {stands} mm high" in done.stdout
    watts = [
        Scale(unit="W").pair(*(float(rows[k][f"power{what} [W]"] or "nan") for what in ("", " error"))) for k in (0, 2)
    ]
    assert f"power {watts[0]} with the new liner, {watts[1]} after" in done.stdout
    assert "not known in steps 0, 1, 2: a window that had not settled, or fewer than four starts" in done.stdout


@pytest.mark.slow
def test_an_interrupted_life_goes_on_to_the_same_rows(life, mill):
    assert mill("sweep", "life.study", "-q", "--no-picture").returncode == 0
    whole = (life / "life/life.csv").read_text()
    (life / "life/life.csv").write_text("".join(whole.splitlines(True)[:2]))
    plan = mill("sweep", "life.study", "--dry-run").stdout
    assert "1 of them are in life" in plan and "of CPU, from a trial of the first run" in plan
    assert mill("sweep", "life.study", "-q", "--no-picture").returncode == 0
    assert (life / "life/life.csv").read_text() == whole


def test_a_life_ends_when_the_liner_stands_lower_than_asked(life):
    def ends(height, *sets):
        return Life(life / "life.study", sets).ended([{"height [m]": 0.05}, {"height [m]": height}])

    assert [ends(h, "life.until=67 %") for h in (0.034, 0.033)] == [ends(h) for h in (0.0051, 0.0049)] == [False, True]


@pytest.mark.parametrize(
    "change, said",
    [
        ({"removed = 4 %": ""}, "[life]: expected one of 'removed = 5 %' and 'after = 500 h'"),
        ({"removed = 4 %": "removed = 4 mm"}, "life.study:6: [life] removed: expected a share such as 5 %, got '4 mm'"),
        (
            {"steps = 2": "stages = 2"},
            "life.study:5: [life] stages: unknown key; there are steps, removed, after, until",
        ),
        ({"[set]": "[vary]\ndrum.lifters = 4, 6\n[set]"}, "nothing varies in a life but the contour"),
    ],
)
def test_a_wrong_life_is_told_with_its_line(life, mill, change, said):
    text = LIFE
    for old, new in change.items():
        text = text.replace(old, new)
    (life / "life.study").write_text(text)
    done = mill("sweep", "life.study")
    assert done.returncode == 2 and said in done.stderr
    assert not (life / "life").exists()


@pytest.mark.slow
def test_a_life_of_a_round_drum_is_refused_before_its_first_run(life, mill):
    (life / "drum.ini").write_text(ROUND)
    done = mill("sweep", "life.study", "-q")
    assert done.returncode == 2
    assert "life.study: [study] deck: expected a drum with a contour" in done.stderr
    assert not (life / "life").exists()


def test_a_life_begins_with_the_contour_that_the_deck_names_beside_it(life, mill):
    contour = subprocess.run([PROGRAM, "--contour", "drum.ini"], cwd=life, check=True, capture_output=True).stdout
    (life / "decks").mkdir()
    (life / "decks/liner.txt").write_bytes(contour)
    rest = [line for line in DRUM.splitlines() if not line.startswith(("profile", "lifter"))]
    rest.insert(rest.index("[drum]") + 1, "profile = file\nfile = liner.txt")
    (life / "decks/drum.ini").write_text("\n".join(rest))
    (life / "decks/life.study").write_text(LIFE.replace("steps = 2", "steps = 1"))
    done = mill("sweep", "decks/life.study", "-q", "--no-picture")
    assert done.returncode == 0, done.stderr
    assert Contour.read(life / "life/step-0.txt").area == pytest.approx(Contour.read(life / "decks/liner.txt").area)


@pytest.mark.slow
def test_a_life_whose_first_run_fails_or_is_stopped_leaves_no_folder(life, mill, monkeypatch):
    done = mill("sweep", "life.study", "--set", "balls.bulk_fill=99 %")
    assert done.returncode == 2 and "balls do not fit" in done.stderr
    assert not (life / "life").exists()

    def stop(asked, reader):
        assert "run.threads=0" in asked["set"]  # of the starts of this run, all cores
        raise KeyboardInterrupt

    monkeypatch.setattr(job, "run", stop)
    with pytest.raises(KeyboardInterrupt, match="has 0 of 3 runs; the same command continues"):
        Life(life / "life.study", folder=life / "life").live(quiet=True)
    assert not (life / "life").exists()


def test_a_folder_of_another_life_is_kept(life, mill):
    (life / "life").mkdir()
    (life / "life/notes.txt").write_text("mine")
    done = mill("sweep", "life.study")
    assert done.returncode == 2 and "no such file" in done.stderr
    assert [one.name for one in (life / "life").iterdir()] == ["notes.txt"]


def test_only_mill_sweep_makes_a_life(life, mill):
    done = mill("optimize", "life.study")
    assert done.returncode == 2 and "only 'mill sweep' makes it" in done.stderr
