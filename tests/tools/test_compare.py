"""mill compare: identical runs agree, other seeds agree, another speed differs; what it says is what the files hold."""

import csv
import dataclasses
import fcntl
import math
import os
import pty
import re
import shutil
import struct
import subprocess
import sys
import termios
from types import SimpleNamespace

import h5py
import layouts
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, some
from scipy.special import stdtrit

from milltools.base.errors import UserError
from milltools.compare import agreement, finding, load, map_deviation, pictures, rows, terminal
from milltools.compare.agreement import Estimate
from milltools.read import sums
from milltools.read.runfile import Run

pytest_plugins = ["reported"]

# Steady from 0.1 s on, and 25 revolutions of it; less than a second to run
MILL = """\
[run]
time = 1.6 s
sample_from = 0.1 s
[balls]
count = 150
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 30 mm
length = 30 mm
[rotor]
speed = 1000 rpm
shaft_radius = 5 mm
[blades]
count = 2
tip_radius = 22 mm
width = 4 mm
thickness = 4 mm
[contact]
restitution = 0.8
rebound_floor = 2 mm/s
friction = 0.3
tangential_restitution = 0.484
"""
RUNS = {
    "one": [],
    "two": ["run.seed=2"],
    "fast": ["rotor.speed=1300 rpm"],
    "transient1": ["run.time=0.1 s", "run.sample_from=0 s"],
    "transient2": ["run.time=0.1 s", "run.sample_from=0 s", "run.seed=2"],
    "transient3": ["run.time=0.1 s", "run.sample_from=0 s", "run.seed=3"],
    "transient_fast": ["run.time=0.1 s", "run.sample_from=0 s", "rotor.speed=2000 rpm"],
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """name -> output file of each of RUNS."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "mill.ini").write_text(MILL)
    for name, sets in RUNS.items():
        words = [word for option in sets for word in ("-s", option)]
        command = [PROGRAM, "-q", "mill.ini", "-o", f"{name}.h5", *words]
        subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=300)
    return {name: folder / f"{name}.h5" for name in RUNS}


def table(*paths):
    """key -> row of the comparison of the second side with the first; a side is a path or a list of them."""
    sides = load.sides([[str(p) for p in (s if isinstance(s, list) else [s])] for s in paths])
    return {row.key: row for row in rows.compare(*sides).rows}


def changed(source, to, **datasets):
    """The path `to`, a copy of a run with other values, "__" for "/" in their names."""
    shutil.copy(source, to)
    with h5py.File(to, "r+") as file:
        for key, value in datasets.items():
            path = key.replace("__", "/")
            if path in file:
                del file[path]
            if value is not None:
                file[path] = value
    return to


@pytest.fixture
def copy(runs, tmp_path):
    """copy(name, to, **datasets): a changed() run of RUNS."""
    return lambda name, to="copy.h5", **datasets: changed(runs[name], tmp_path / to, **datasets)


@pytest.mark.slow
def test_a_run_agrees_with_itself_and_differs_by_nothing(runs):
    found = table(runs["one"], runs["one"])
    assert len(found) >= 39
    for key, row in found.items():
        assert row.difference == 0 or np.isnan(row.difference), key
        assert row.mood == "agree" or key == "cost", key


@pytest.mark.slow
def test_another_seed_agrees(runs):
    found = table(runs["one"], runs["two"])
    assert [key for key, row in found.items() if row.mood == "differ"] == []
    assert found["ball_speed_mean"].verdict == "agree"


@pytest.mark.slow
def test_another_speed_differs(runs):
    found = table(runs["one"], runs["fast"])
    for key in (
        "rotor_power",
        "dissipated_power",
        "normal_dissipation_ball_ball",
        "kinetic_energy",
        "rate_ball_ball_above_1",
        "ball_speed_rms",
        "map_cross_section_velocity",
    ):
        assert found[key].mood == "apart", key
        assert found[key].difference > 0, key
    row = found["rotor_power"]
    assert (row.verdict, found["hard_per_joule_0.5"].verdict) == ("higher", "lower")
    assert row.interval[1] - row.difference == pytest.approx(1.96 * row.difference_error)
    assert found["hard_per_joule_1"].a.value == pytest.approx(found["rate_all_above_1"].a.value / row.a.value)


@pytest.mark.slow
def test_the_same_mill_in_another_program_agrees_or_differs(runs, copy):
    found = table(runs["one"], copy("fast", run__program="LIGGGHTS"))
    words = found["rotor_power"].verdict
    sigmas = float(re.fullmatch(r"differ by (\S+) standard errors", words).group(1))
    row = found["rotor_power"]
    assert sigmas == pytest.approx(row.difference / row.difference_error, abs=0.06)


@pytest.mark.slow
def test_errors_of_old_files_without_degrees_of_freedom_are_used(copy):
    path = copy("one", to="old.h5")
    with h5py.File(path, "r+") as file:
        told = file["statistics/precision/median_above_floor"]
        del told["degrees_of_freedom"]
        error = told["standard_error"][()]
    row = table(path, path)["median_above_floor"]
    assert (row.a.error, row.a.dof) == (error, np.inf)


@pytest.mark.parametrize("part", ["value", "standard_error", "degrees_of_freedom"])
def test_a_result_with_too_few_values_is_named(copy, part):
    path = copy("one", to="short.h5")
    place = f"statistics/precision/fast_rate/all/{part}"
    with h5py.File(path, "r+") as file:
        values = file[place][:2]
        del file[place]
        file[place] = values
    with pytest.raises(UserError, match=f"short.h5: damaged: /{place}: it has the shape"):
        table(path, path)


@pytest.mark.slow
def test_values_are_those_of_the_file(runs):
    found = table(runs["one"], runs["fast"])
    for key, label in (("rate", "above 2 m/s"), ("strike_rate", "above 2 m/s (strikes)")):
        assert found[f"{key}_ball_blade_above_2"].label.strip() == f"ball-blade {label}"
    for side, name in (("a", "one"), ("b", "fast")):
        with h5py.File(runs[name]) as file:
            window, row = file["statistics/duration"][()], round(0.1 / 0.001)
            power = file["statistics/rotor/power"][()]
            series = {n: file[f"observables/{n}"] for n in ("dissipation", "dissipation_normal", "fast_collisions")}
            grown = {n: {k: v["value"][-1] - v["value"][row] for k, v in one.items()} for n, one in series.items()}
            lost, normal, fast = ({k: v / window for k, v in one.items()} for one in grown.values())
            time = file["observables/kinetic_energy/time"][row:]
            energy = {n: file[f"observables/{n}_energy/value"][row:] for n in ("kinetic", "rotational")}
            balls = file["particles/trajectory/velocity"]
            speed = np.linalg.norm(balls["value"][:][balls["time"][:] > 0.1 - 1e-9].astype(float), axis=2)
            strikes = file["statistics/strikes/ball_blade/normal_speed/histogram"]
            hard = strikes["count"][:][strikes["edges"][:-1] > 1 - 1e-9].sum() / window
            expected = {
                "rotor_power": power,
                "rotor_torque": file["statistics/rotor/torque"][()],
                "dissipated_power": sum(lost.values()),
                "normal_dissipation": sum(normal.values()),
                "tangential_dissipation": sum(lost.values()) - sum(normal.values()),
                "rate_all": file["statistics/impacts/all/count"][()] / window,
                "strike_rate_ball_blade_above_1": hard,
                "ball_speed_mean": speed.mean(),
                "ball_speed_rms": np.sqrt((speed**2).mean()),
                "cost": file["run/cpu_time"][()] / file["run/time"][()],
            }
            expected |= {
                n: file[f"statistics/impacts/all/normal_speed/{n}"][()] for n in ("median", "median_above_floor")
            }
            expected |= {
                f"{n}_energy": np.diff(time) @ (v[1:] + v[:-1]) / 2 / (time[-1] - time[0]) for n, v in energy.items()
            }
            expected |= {f"dissipated_power_{k}": v for k, v in lost.items()}
            expected |= {f"normal_dissipation_{k}": v for k, v in normal.items()}
            for column, limit in enumerate(("0.5", "1", "2")):
                expected |= {f"rate_{k}_above_{limit}": v[column] for k, v in fast.items()}
                expected[f"rate_all_above_{limit}"] = sum(v[column] for v in fast.values())
                expected[f"hard_per_joule_{limit}"] = expected[f"rate_all_above_{limit}"] / power
            for share in (10, 50, 90, 99):
                expected[f"ball_speed_{share}"] = np.mean(np.quantile(speed, share / 100, axis=1))
            times = balls["time"][:][balls["time"][:] > 0.1 - 1e-9]
            bounds = load.Member(str(runs[name])).bounds
            block = np.minimum(np.searchsorted(bounds, times, "right"), len(bounds) - 1) - 1
            each = np.sqrt(np.bincount(block, (speed**2).mean(axis=1)) / np.bincount(block))
            assert bounds == pytest.approx(np.linspace(0.1, 1.6, 26) if side == "a" else bounds)
            assert getattr(found["ball_speed_rms"], side).error == pytest.approx(agreement.from_blocks(1, each).error)
        for key, value in expected.items():
            assert value == 0 or getattr(found[key], side).value == pytest.approx(value, rel=1e-9), key
    rest = set(found) - set(expected)
    rest -= {"hard_rate", "hard_per_joule"}
    assert all(key.startswith(("map_", "strike_rate_")) for key in rest), rest


@pytest.mark.parametrize(
    "key, name, column",
    [
        ("rotor_power", "rotor_power", ()),
        ("rotor_torque", "rotor_torque", ()),
        ("median", "median", ()),
        ("median_above_floor", "median_above_floor", ()),
        ("rate_all", "rate/all", ()),
        ("rate_ball_ball_above_1", "fast_rate/ball_ball", 1),
        ("rate_all_above_2", "fast_rate/all", 2),
    ],
)
@pytest.mark.slow
def test_the_error_is_the_one_that_the_file_tells(runs, key, name, column):
    with h5py.File(runs["one"]) as file:
        told = file[f"statistics/precision/{name}"]
        value, error, freedom = (told[part][column] for part in ("value", "standard_error", "degrees_of_freedom"))
    found = table(runs["one"], runs["two"])[key].a
    assert (found.value, found.dof) == (value, pytest.approx(freedom))
    assert found.error * stdtrit(freedom, 0.975) == pytest.approx(1.96 * error)


@pytest.mark.slow
def test_a_file_that_tells_no_errors_has_them_from_its_revolutions(runs, copy):
    """Independent where there are fewer than eight."""
    short = copy("one", statistics__duration=0.42, statistics__precision=None)
    with h5py.File(runs["one"]) as file:
        series = file["observables/rotor_work"]
        at = 0.1 + 0.06 * np.arange(8)
        blocks = np.diff(np.interp(at, series["time"][:], series["value"][:])) / 0.06
    found = table(short, short)["rotor_power"]
    assert found.a.error == pytest.approx(np.std(blocks, ddof=1) / np.sqrt(7), rel=1e-6)
    assert found.a.dof == pytest.approx(6)


def test_a_transient_alone_has_no_error(runs):
    found = table(runs["transient1"], runs["transient2"])
    row = found["rotor_power"]
    assert row.verdict == "error unknown: not steady, no replicates"
    assert np.isnan(row.difference_error) and np.isfinite(row.difference)
    assert found["map_cross_section_velocity"].verdict == "noise unknown"
    assert found["kinetic_energy_end"].a.value > found["kinetic_energy"].a.value


@pytest.mark.slow
def test_replicates_of_a_transient_tell_its_error(runs):
    replicates = [runs[f"transient{k}"] for k in (1, 2, 3)]
    row = table(replicates, runs["transient_fast"])["kinetic_energy"]
    each = np.array([table(r, r)["kinetic_energy"].a.value for r in replicates])
    scatter = each.std(ddof=1) / each.mean()
    assert row.a.value == pytest.approx(each.mean())
    assert row.a.error == pytest.approx(scatter * row.a.value / np.sqrt(3))
    assert row.b.error == pytest.approx(scatter * row.b.value)
    assert (row.dof, row.mood) == (pytest.approx(2), "apart")


@pytest.mark.parametrize(
    "second, words",
    [
        ("fast", "rotor.speed is 1300 rpm, not 1000 rpm"),
        ("one", "same seed and start as another replicate"),
        ("transient2", "run.sample_from is 0 s, not 0.1 s"),
    ],
)
@pytest.mark.slow
def test_what_is_no_replicate_is_refused(mill, runs, second, words):
    done = mill("compare", f"{runs['one']},{runs[second]}", runs["two"])
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert words in done.stderr


@pytest.mark.slow
def test_a_comma_in_a_name_is_no_list(mill, copy):
    path = copy("one", to="a,b.h5")
    done = mill("compare", path, path)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
def test_three_files_are_compared_with_the_first(mill, runs):
    done = mill("compare", runs["one"], runs["two"], runs["fast"])
    assert done.returncode == 0, done.stderr
    assert re.findall(r"^(.) against (.)$", done.stdout, re.M) == [("B", "A"), ("C", "A")]
    assert "geometry" not in done.stdout
    assert re.search(r"^  rotor\.speed +1000 rpm \| 1000 rpm \| 1300 rpm$", done.stdout, re.M)  # fmt: skip


@pytest.mark.slow
def test_warnings_name_what_is_not_alike(mill, runs, copy):
    made = {"run__program": "LIGGGHTS", "run__contact_duration": "5e-5", "run__status": "stopped"}
    other = copy("two", deck__drum__radius="0.031 m", **made)
    done = mill("compare", runs["transient1"], other)
    assert f"A ({runs['transient1']}) is not steady over its window: " in done.stdout
    assert f"B ({other}) is not complete (status 'stopped')" in done.stdout
    assert "The sampled windows of A and B differ." in done.stdout
    assert "Contacts last 50 us in B, A counts impacts within 23.8 us as one strike" in " ".join(done.stdout.split())
    assert "The geometry of A and B differs: drum.radius." in done.stdout


@pytest.mark.slow
def test_soft_spheres_are_not_judged_by_what_depends_on_softness(runs, copy):
    soft = copy("two", run__program="LIGGGHTS", run__price=500.0)
    found = table(runs["one"], soft)
    for key in ("rate_all", "median", "median_above_floor"):
        assert found[key].verdict == "not comparable between hard and soft spheres"
    assert found["ball_speed_mean"].verdict == "agree"
    ratio = 500 / found["cost"].a.value
    assert found["cost"].verdict == f"B costs {ratio:.3g} times as much as A"
    assert table(soft, copy("one", to="softer.h5", run__program="LIGGGHTS"))["rate_all"].verdict == (
        "depends on the stiffness"
    )


@pytest.mark.slow
def test_without_fast_counts_and_errors_in_the_file_errors_of_rates_are_not_known(runs, copy):
    bare = copy("one", observables__fast_collisions=None, statistics__precision=None)
    row = table(bare, runs["two"])["rate_ball_ball_above_0.5"]
    assert row.a.value > 0 and math.isnan(row.a.error) and row.verdict.startswith("error unknown")


@pytest.mark.slow
def test_impacts_per_joule_have_the_scatter_of_impacts_minus_losses_in_blocks_of_time(runs, copy):
    """Impacts and losses of each block by hand: of one species, speeds are energies. Without blocks: no error."""
    row = table(runs["one"], runs["two"])["hard_per_joule_0.5"]
    with Run(runs["one"]) as run:
        hard, lost, least = 0.0, 0.0, run.balls("mass")[0] * 0.5**2 / 2
        low = np.append(0, run.read("statistics/energies/blocks/edges")[1:-1])
        for kind in run.kinds:
            half = 0.5 if kind == "ball_ball" else 1.0
            by_approach, by_loss = (
                run.read(f"statistics/energies/blocks/{kind}/{sort}") for sort in ("normal", "dissipated")
            )
            hard = hard + by_approach.reshape(len(by_approach), -1) @ (low >= half * least)
            lost = lost + by_loss.reshape(len(by_loss), -1) @ (low * 1.09)
    rest = hard / hard.mean() - lost / lost.mean()
    alone = hard / hard.mean()
    means = [x[len(x) % 24 :].reshape(24, -1).mean(axis=1) for x in (rest, alone)]  # longer blocks are less correlated
    expected, apart = (x.std(ddof=1) / np.sqrt(24) for x in means)
    assert 0.5 * expected < row.a.error / row.a.value < 2 * expected
    assert math.isnan(table(copy("one", statistics__energies__blocks=None), runs["two"])["hard_per_joule_0.5"].a.error)


@pytest.mark.slow
def test_impacts_of_a_millijoule_or_more_are_those_of_the_file_per_second_and_per_joule(millsim, write_deck, tmp_path):
    write_deck(MILL.replace("diameter = 5 mm", "diameter = 8 mm").replace("count = 150", "count = 30"))
    assert millsim("deck.ini", "-q", "-s", "run.hard_impact=1 mJ", "-o", "a.h5").returncode == 0
    path = tmp_path / "a.h5"
    sides = load.sides([[str(path)], [str(changed(path, tmp_path / "b.h5", statistics__precision=None))]])
    found = rows.compare(*sides)
    rate, each = found.row("hard_rate"), found.row("hard_per_joule")
    with h5py.File(path) as file:
        told = file["statistics/precision"]
        value, error = (told[f"hard_rate/{name}"][()] for name in ("value", "standard_error"))
        per = [told[f"hard_per_joule/{name}"][()] for name in ("value", "standard_error", "degrees_of_freedom")]
        power = file["statistics/rotor/power"][()]
    assert value > 100
    assert (rate.a.value, rate.a.told, each.a.value) == pytest.approx((value, error, value / power))
    assert (each.a.value, each.a.told, each.a.dof) == pytest.approx(per)
    assert (rate.b.value, rate.b.told) == pytest.approx((value, error), rel=0.02)  # from histograms and blocks
    assert each.b.value == pytest.approx(value / power, rel=0.02)
    with Run(path) as run:
        hard, lost = sums.total(run, sums.above(1e-3)), sums.total(run, sums.itself, "dissipated")
    ratio, error, _ = hard.over(lost)
    assert each.a.told / each.a.value == pytest.approx(error / ratio, rel=0.02)  # losses without and with bins
    assert each.b.told / each.b.value == pytest.approx(max(error / ratio, hard.least / hard.value))
    assert each in found.important and each.name == "impacts of 1 mJ or more, per joule"


@pytest.mark.slow
def test_without_energies_or_impacts_of_a_millijoule_there_are_no_rows_of_them(runs, copy, millsim, write_deck):
    told = {f"statistics__precision__{name}": None for name in ("hard_rate", "hard_per_joule")}
    bare = copy("one", statistics__energies=None, **told)
    write_deck(MILL.replace("7800 kg/m^3", "100 kg/m^3"))
    assert millsim("deck.ini", "-q", "-s", "run.hard_impact=1 mJ", "-o", "light.h5").returncode == 0
    for path in (bare, bare.parent / "light.h5"):
        found = table(path, path)
        assert "hard_per_joule_0.5" in found and not {"hard_rate", "hard_per_joule"} & set(found)


@pytest.mark.slow
def test_where_the_file_tells_no_errors_blocks_do(runs, copy):
    bare = table(copy("one", statistics__precision=None), runs["two"])
    torque, power = bare["rotor_torque"].a, bare["rotor_power"].a
    assert torque.error / torque.value == pytest.approx(power.error / power.value)
    told = table(runs["one"], runs["two"])["rate_all_above_1"].a
    counted = bare["rate_all_above_1"].a
    assert counted.value == pytest.approx(told.value)
    assert 0.2 * told.error < counted.error < 5 * told.error


@pytest.mark.slow
def test_what_only_one_file_holds_is_said(runs, copy):
    bare = copy("two", observables__dissipation=None, statistics__precision__dissipated_power=None)
    row = table(runs["one"], bare)["dissipated_power"]
    assert row.verdict == "only in A: the file of B does not contain it"
    assert np.isfinite(row.a.value) and np.isnan(row.b.value)


@pytest.mark.slow
def test_the_csv_holds_every_row_with_all_digits(mill, runs, tmp_path):
    done = mill("compare", runs["one"], runs["two"], runs["fast"], "--csv", "out.csv")
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out.csv", newline="") as file:
        found = list(csv.DictReader(file))
    expected = table(runs["one"], runs["two"])
    assert len(found) >= 80
    for line in found:
        if line["run"] == str(runs["two"]):
            row = expected[line["quantity"]]
            assert float(line["value"] or "nan") == pytest.approx(row.b.value, rel=0, nan_ok=True)
            assert line["verdict"] == row.verdict
            if line["low_percent"]:
                ends = [float(line[name]) / 100 for name in ("low_percent", "high_percent")]
                assert ends == pytest.approx(row.interval)
    assert {line["run"] for line in found} == {str(runs["two"]), str(runs["fast"])}


def test_nothing_from_a_run_gets_out_of_its_place(compared):
    _, text, _, said = compared
    assert "\x1b" not in said
    for foreign in ("<script>alert", "<img src=x", "</code><b>", "\x1b"):
        assert foreign not in text
    assert "&lt;script&gt;alert(2)&lt;/script&gt;" in text
    assert "&lt;img src=x onerror=alert(1)&gt;" in text


def test_the_page_needs_nothing_but_itself(compared):
    _, text, read, _ = compared
    links = [a[name] for _, a in read.tags for name in ("src", "href") if name in a]
    assert links and all(link.startswith(("data:", "#")) for link in links)
    assert not re.search('<img src="(?!data:)', text)
    (policy,) = (a["content"] for t, a in read.tags if a.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy


def test_the_page_has_pictures_figures_and_the_balls_of_both(compared):
    path, _, read, _ = compared
    assert path.stat().st_size < 10e6
    assert [a.get("class") for t, a in read.tags if t == "figure"].count("mill-player") == 2
    assert {"verdict", "notes", "balls", "tables", "pictures", "energy", "spectra", "maps", "deck", "cite"} <= set(
        read.ids("section")
    )
    assert "figure-speeds" in read.ids("figure")
    assert read.text.startswith("slow1 ") and "per joule" in read.text and "save A.ini" in read.text
    assert {"forest", *(f"figure-compared-{name}" for name in ("spectra", "over-time", "sections"))} <= set(
        read.ids("figure")
    )
    anchors = [a["href"][1:] for t, a in read.tags if t == "a" and a["href"].startswith("#")]
    assert set(anchors) <= {a["id"] for _, a in read.tags if "id" in a}


@pytest.mark.slow
def test_files_are_written_though_nobody_reads_the_text(runs, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools")}
    words = [sys.executable, "-m", "milltools", "compare", runs["one"], runs["two"], "--csv", "table.csv"]
    process = subprocess.Popen(words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE)
    process.stdout.close()  # as `| head` does
    process.wait(timeout=60)
    assert len((tmp_path / "table.csv").read_text().splitlines()) > 40


@pytest.mark.parametrize(
    "stored, shown",
    [
        ("0.012700000000000001 m", "0.0127 m"),
        ("104.71975511965978 rad/s", "1000 rpm"),
        ("3.1415926535897931 rad", "180 deg"),
        ("0 0 -9.8100000000000005 m/s^2", "0 0 -9.81 m/s^2"),
        ("0.29999999999999999", "0.3"),
        ("12345678901234567", "12345678901234567"),
        ("wavy", "wavy"),
        ("", ""),
    ],
)
def test_values_of_decks_are_shown_as_decks_are_written(stored, shown):
    assert load.usual(stored) == shown


def test_rows_that_are_zero_on_both_sides_are_said_once(capsys):
    sides = [SimpleNamespace(letter=letter, name=letter, runs=[SimpleNamespace(path=letter)]) for letter in "AB"]
    none, some = Estimate(0.01, 0.02, np.inf), Estimate(5.0, 0.1, np.inf)
    assert rows.is_zero(none) and rows.is_zero(Estimate(0.0)) and not rows.is_zero(some)
    made = [
        rows.Row("power", key, key, "W", e, e, 0.1, 0.1, 9, verdict, "open", "")
        for key, e, verdict in (("shaft", none, rows.ZERO), ("drum", some, "agree"))
    ]
    terminal.show([], [rows.Comparison(*sides, made)], [])
    said = capsys.readouterr().out
    assert "Zero within their errors in A and in B: shaft." in said
    assert len(re.findall("^drum", said, re.M)) == 1 and not re.search("^shaft", said, re.M)


def made(key, a, b, error):
    """A row of two designs, with a relative error of either side."""
    pair = [Estimate(value, error * value, np.inf) for value in (a, b)]
    return rows.Row(
        "", key, key, "W" if "power" in key else "1/s", *pair, *agreement.difference(*pair, "unknown", designs=True)
    )


def two_designs(*made_rows):
    return rows.Comparison(*(SimpleNamespace(name=name, letter=name) for name in ("old", "new")), list(made_rows), True)


def test_the_title_names_what_a_joule_buys_and_the_power():
    power, rate = made("rotor_power", 200, 120, 0.01), made("rate_all_above_1", 1e5, 1.1e5, 0.01)
    better = two_designs(made("hard_per_joule_1", 500, 625, 0.01), power, rate)
    assert finding.title(better) == (
        "new makes 25 % more impacts above 1 m/s per joule than old and draws 40 % less power"
    )
    assert finding.interval(made("power", 500, 625, 0.004)) == "+24 to +26 %"
    assert finding.size(made("power", 100, 250, 0.01), *finding.MUCH)[0] == "2.50 times as much"
    first, *others = finding.sentences(better)
    assert "new makes 625 impacts above 1 m/s, old makes 500: 25 % more (22 to 28 %)." in first
    assert "On the scale of impacts per joule, new is better above 1 m/s (+25 %)." in others
    tied = two_designs(made("hard_per_joule_1", 500, 505, 0.01), made("rotor_power", 200, 700, 0.01), rate)
    assert finding.title(tied) == (
        "new and old are tied in impacts above 1 m/s per joule; new draws 3.50 times as much power"
    )
    moods = ("agree", "differ", "agree")
    some_rows = [dataclasses.replace(row, mood=mood) for row, mood in zip(tied.rows, moods)]
    seeds = dataclasses.replace(tied, designs=False, rows=some_rows)
    assert finding.title(seeds) == "new and old agree in 2 of 3 quantities and differ in 1"


@pytest.mark.parametrize(
    "keys, said",
    [
        (("drum.profile", "drum.buckles"), None),
        (("drum.profile", "blades.tip_radius", "drum.buckles"), "blades.tip_radius, drum.profile, drum.buckles"),
        (
            ("a.one", "a.two", "a.three", "a.four", "b.five", "c.six"),
            "b.five, c.six, a.one, a.two and 2 more keys",
        ),
        (("a.one", "a.two", "a.three", "a.four", "b.five"), "b.five, a.one, a.two, a.three and 1 more key"),
    ],
)
def test_the_finding_says_that_more_than_one_section_differs(keys, said):
    table = two_designs(made("hard_per_joule_1", 500, 625, 0.01), made("rotor_power", 200, 120, 0.01))
    _, *others = finding.sentences(dataclasses.replace(table, keys=keys))
    if said:
        assert others[0] == f"The decks differ in {said}: this is the effect of all differences together."
    else:
        assert "decks" not in " ".join(others)


@pytest.mark.slow
def test_how_a_mill_is_run_is_no_difference_of_its_sections(copy):
    sides = load.sides([[str(copy("one", to=f"{k}.h5", deck__run__seed=k, deck__drum__radius=f"{k} m"))] for k in "12"])
    table = rows.compare(*sides)
    assert table.designs and table.keys == ("drum.radius",)


def test_no_line_of_the_forest_plot_runs_through_a_text():
    table = two_designs(
        made("rotor_power", 200, 120, 0.01),
        *(made(f"hard_per_joule_{speed}", 500, b, 0.01) for speed, b in (("0.5", 490), ("1", 700), ("2", 1040))),
        *(made(f"dissipated_power_{k}", 200, 100, 0.01) for k in range(20)),
    )
    for side in (table.a, table.b):
        side.label = side.name = "a_name_without_an_end_" * 3
    (figure,) = (figure for name, *_, figure in some_pictures([table]) if name == "forest")
    assert not layouts.faults(figure)
    figure.canvas.draw()
    (ax,) = figure.axes
    boxes = [text.get_window_extent() for text in ax.texts]
    upright = [line for lines in ax.collections for line in lines.get_segments()]
    assert len(boxes) > 40 and len(upright) > 40
    for line in upright:
        (x, one), (_, two) = ax.transData.transform(line)
        for box in boxes:
            assert not (box.x0 < x < box.x1 and box.y0 < max(one, two) and min(one, two) < box.y1)
    assert not any(line.get_visible() for line in ax.get_xgridlines())


def test_above_all_pictures_each_finding_has_its_own_line(tmp_path, monkeypatch):
    table = two_designs(made("rotor_power", 200, 120, 0.01))
    table.a.label, table.b.label = table.a.name, table.b.name
    monkeypatch.setattr(pictures, "PICTURES", pictures.PICTURES[:1])
    pictures.write([table, table], tmp_path / "all.svg")
    assert (tmp_path / "all.svg").read_text().count(f">{finding.title(table)[:20]}") == 2


def some_pictures(tables):
    """The figures of tables without runs: only the forest plot has data."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "PICTURES", pictures.PICTURES[:1])
        yield from pictures.figures(tables)


def test_impacts_of_a_millijoule_are_named_first_and_speeds_where_their_number_is_not_known():
    power, by_speed = (
        made("rotor_power", 200, 120, 0.01),
        [
            made("rate_all_above_1", 1e5, 1.1e5, 0.01),
            made("hard_per_joule_1", 500, 510, 0.01),
        ],
    )
    energetic = made("hard_rate", 1e3, 3e3, 0.01), made("hard_per_joule", 5, 19, 0.01)
    assert finding.title(two_designs(power, *by_speed, *energetic)) == (
        "new makes 3.8 times as many impacts of 1 mJ or more per joule as old and draws 40 % less power"
    )
    none = [Estimate(0.0, np.nan, 0)] * 2
    rare = rows.Row("", "hard_rate", "", "1/s", *none, *agreement.difference(*none, "", designs=True))
    assert "tied in impacts above 1 m/s per joule" in finding.title(two_designs(power, *by_speed, rare))


def counted(key, a, b, unit):
    """A row of two designs, 0 without an error."""
    pair = [Estimate(value, 0.01 * value, np.inf) if value else Estimate(0.0) for value in (a, b)]
    return rows.Row("impacts", key, key, unit, *pair, *agreement.difference(*pair, "unknown", designs=True))


@pytest.mark.parametrize(
    "a, b, title, sentence",
    [
        (
            0,
            227.4,
            "new makes 227 impacts of 1 mJ or more per joule, old makes none; new draws 40 % less power",
            "Per joule of work new makes 227 impacts of 1 mJ or more, old makes none. ",
        ),
        (
            227.4,
            0,
            "old makes 227 impacts of 1 mJ or more per joule, new none; new draws 40 % less power",
            "Per joule of work new makes no impacts of 1 mJ or more, old makes 227. ",
        ),
    ],
)
def test_where_one_side_makes_none_the_title_says_so_and_no_other_threshold_says_the_opposite(a, b, title, sentence):
    power, speeds = made("rotor_power", 200, 120, 0.01), [made("rate_all_above_1", 100 * b + 1, 100 * a + 1, 0.01)]
    speeds.append(made("hard_per_joule_1", 100 * b + 1, 100 * a + 1, 0.01))
    hard = counted("hard_rate", 50 * a, 50 * b, "1/s"), counted("hard_per_joule", a, b, "1/J")
    table = two_designs(power, *speeds, *hard, counted("hard_per_joule_2", a, b, "1/J"))
    assert finding.title(table) == title
    first, *others = finding.sentences(table)
    assert sentence in first and "nan" not in " ".join([first, *others])
    scale = "better above 2 m/s (old makes none)" if b else "worse above 2 m/s (\N{MINUS SIGN}100 %)"
    assert scale in others[-1]
    only = "new makes 227 impacts of 1 mJ or more per joule, old makes none"
    assert finding.title(two_designs(*hard)) == (only if b else title.partition(";")[0])


def test_a_title_leaves_out_what_is_not_known_well_enough():
    wide = two_designs(made("hard_per_joule_1", 500, 510, 0.2), made("rate_all_above_1", 100, 150, 0.01))
    assert finding.title(wide) == "new makes 50 % more impacts above 1 m/s per second than old"
    assert "undecided (" in finding.sentences(wide)[0]
    blind = [made(*row, math.nan) for row in (("hard_per_joule_1", 1426, 1264), ("rate_all_above_1", 1e6, 3e6),
             ("hard_per_joule", 109, 164), ("hard_rate", 9e4, 4e5), ("rotor_power", 864, 2346))]  # fmt: skip
    assert finding.title(two_designs(*blind)) == "new against old: what differs is not known"
    assert finding.sentences(two_designs(*blind))[0].startswith(
        "Per joule of work new makes 164 impacts of 1 mJ or more, old makes 109"
    )
    assert finding.title(two_designs(*blind, made("dissipated_power", 862, 2339, 0.01))) == (
        "new against old: 1 row of the table differs, such as lost power, all (+171 %); the errors of power and of "
        "impacts of 1 mJ or more are not known well enough"
    )


def test_a_finding_has_no_size_where_there_was_nothing_before():
    none = [Estimate(0.0, 0.1, np.inf), Estimate(5.0, 0.1, np.inf)]
    row = rows.Row("", "hard_per_joule_2", "", "1/J", *none, *agreement.difference(*none, "", designs=True))
    said = " ".join(finding.sentences(two_designs(row, made("rotor_power", 1e-3, 2.0, 0.01))))
    assert row.verdict == "higher" and "nan" not in said
    assert "new draws 2 W, old draws 0.001 W: 2000 times as much (" in said


def test_names_in_a_finding_are_no_templates():
    table = two_designs(made("rotor_power", 200, 120, 0.01))
    table.b.name = "{0}{x"
    assert finding.sentences(table)[0].startswith("{0}{x draws 120 W, old draws 200 W")


@pytest.mark.parametrize("view", ["cross_section", "axial"])
def test_sums_brought_to_other_cells_are_conserved(view):
    random = np.random.default_rng(4)
    old = np.linspace(0 if view == "axial" else -75, 75, 31)
    new = np.linspace(0 if view == "axial" else -79, 79, 23)
    sums = random.random((30, 30))
    found = map_deviation.divided(sums, (old, old), (new, new), view)
    assert found.sum() == pytest.approx(sums.sum())
    area = np.diff(old**2) if view == "axial" else np.diff(old)
    whole = map_deviation.divided(np.outer(np.diff(old), area), (old, old), (new, new), view)
    inside = np.diff(new[3:-3] ** 2) if view == "axial" else np.diff(new[3:-3])
    assert whole[3:-3, 3:-3] == pytest.approx(np.outer(np.diff(new[3:-3]), inside))  # an even field stays even


@pytest.mark.slow
def test_maps_of_chambers_of_different_size_have_a_deviation(millsim, runs, write_deck, tmp_path):
    write_deck(MILL.replace("[drum]", "[drum]\nprofile = wavy\nbuckles = 6\nbuckle_height = 3 mm"))
    assert millsim("deck.ini", "-q", "-o", "wavy.h5").returncode == 0
    a, b = load.sides([[str(runs["one"])], [str(tmp_path / "wavy.h5")]])
    found = {row.key: row for row in rows.compare(a, b).rows}
    assert 0.05 < found["map_cross_section_solid_fraction"].difference < 2
    cells = map_deviation.common([a.first, b.first], "cross_section")
    for side in (a, b):  # the balls are all there
        filled = side.mean_map("solid_fraction", "cross_section", cells) * map_deviation.room(
            side.first, "cross_section", cells
        )
        assert np.nansum(filled) == pytest.approx(150 * np.pi / 6 * 5e-3**3, rel=2e-3)
    beyond = ~map_deviation.shared([a.first, b.first], "cross_section", cells)
    assert beyond.any() and not beyond.all()


@pytest.mark.parametrize(
    "words, line",
    [
        (["one"], "one run cannot be compared; give two or more"),
        (["one", "missing.h5"], "missing.h5: no such file"),
        (["one", "text.h5"], "text.h5: not a readable HDF5 file: "),
        (["one", ","], "',' contains no file name"),
    ],
)
def test_wrong_input_is_one_line_and_status_2(mill, runs, tmp_path, words, line):
    (tmp_path / "text.h5").write_text("no HDF5")
    done = mill("compare", *(runs.get(w, w) for w in words))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"mill compare: {line}")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("option", ["--csv", "--png", "--html"])
def test_an_output_that_cannot_be_written_is_one_line(mill, runs, option):
    done = mill("compare", runs["one"], runs["one"], option, "nowhere/out.png")
    assert (done.returncode, done.stderr) == (2, "mill compare: nowhere/out.png: there is no folder nowhere\n")


@pytest.mark.slow
@pytest.mark.parametrize(
    "option, picture", some([("output.series=0.5 s", "--png"), ("output.frames=0 s", "--html")], 2)
)
def test_runs_that_store_little_are_compared_all_the_same(millsim, mill, write_deck, option, picture):
    write_deck(MILL)
    assert millsim("deck.ini", "-q", "-s", option).returncode == 0
    done = mill("compare", "deck.h5", "deck.h5", picture, "out.png")
    assert done.returncode == 0, done.stderr
    assert "agree: the same data" in done.stdout


@pytest.mark.slow
def test_a_mill_without_a_rotor_is_compared(millsim, mill, write_deck):
    gas = re.sub(r"\[rotor\].*?(?=\[contact\])", "", MILL, flags=re.S)
    write_deck(gas + "[gravity]\nacceleration = 0 0 0 m/s^2\n")
    for seed in (1, 2):
        sets = [f"run.seed={seed}", "balls.speed=1 m/s", "contact.restitution=1", "contact.friction=0"]  # fmt: skip
        done = millsim("deck.ini", "-q", "-o", f"{seed}.h5", *(w for s in sets for w in ("-s", s)))
        assert done.returncode == 0, done.stderr
    done = mill("compare", "1.h5", "2.h5")
    assert (done.returncode, done.stderr) == (0, "")
    assert "10 equal blocks of 0.15 s" in done.stdout
    assert not re.search("^rotor power", done.stdout, re.M)
    assert re.search(r"^speed of balls, mean .* agree$", done.stdout, re.M)


def on_terminal(columns, *words):
    """What the command shows on a terminal of so many columns."""
    try:
        master, slave = pty.openpty()
    except OSError as fault:
        pytest.skip(f"no terminal to be had here: {fault}")
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    environment = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES", "NO_COLOR")}
    environment |= {"PYTHONPATH": str(ROOT / "tools"), "TERM": "xterm-256color"}
    process = subprocess.Popen([sys.executable, "-m", "milltools", "compare", *words], stdout=slave, env=environment)
    os.close(slave)
    shown = b""
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown += part
    os.close(master)
    assert process.wait(timeout=60) == 0
    return shown.decode()


@pytest.mark.slow
def test_a_terminal_gets_colours_and_one_too_narrow_keeps_all_figures(runs):
    wide, narrow = (on_terminal(columns, runs["one"], runs["fast"]) for columns in (170, 60))
    assert "\x1b[" in wide and "┃" in wide
    assert "\x1b[" not in narrow
    figure = re.search(r"rotor power\s+(\S+)\s+(\S+)\s+W", narrow)
    assert all(number in wide for number in figure.groups())


@pytest.mark.slow
def test_the_noise_of_maps_is_known_in_a_wavy_drum_as_well(millsim, mill, write_deck, tmp_path):
    write_deck(MILL.replace("[drum]", "[drum]\nprofile = wavy\nbuckles = 6\nbuckle_height = 3 mm"))
    for seed in (1, 2):
        done = millsim("deck.ini", "-q", "-o", f"{seed}.h5", "-s", f"run.seed={seed}")
        assert done.returncode == 0, done.stderr
    done = mill("compare", "1.h5", "2.h5", "--png", "out.png")
    assert (done.returncode, done.stderr) == (0, "")
    maps = [line for line in done.stdout.splitlines() if "noise explains it" in line]
    assert len(maps) >= 3
    assert "noise unknown" not in done.stdout
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
