"""mill plot --figure: what is drawn is what the file holds; pictures are compared by their structure."""

import base64
import dataclasses
import re
import signal
import subprocess
import time
import xml.etree.ElementTree as ET
from types import SimpleNamespace

import h5py
import layouts
import matplotlib
import numpy as np
import pandas as pd
import pytest
from conftest import PROGRAM, SMALL, run_mill, slow
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Rectangle

from milltools import figures
from milltools.__main__ import main
from milltools.base.errors import UserError
from milltools.dose.wear import ENOUGH
from milltools.figures import (
    FIGURES,
    bins,
    energies,
    flow,
    inline,
    maps,
    outlines,
    overtime,
    overview,
    sankey,
    spectra,
    style,
)
from milltools.geometry import contour
from milltools.read.histogram import Histogram, _of_pairs
from milltools.read.kinds import KINDS
from milltools.read.runfile import Run

ANY = [name for name in FIGURES if name not in ("charge", "liner")]  # of any mill; see test_charge_figure, test_liner
PLAIN = SMALL.replace("count = 20", "count = 300").replace("time = 50 ms", "time = 0.25 s\nsample_from = 0.05 s")
MIXTURE = """
[run]
time = 0.1 s
sample_from = 0.02 s
[balls.big]
count = 80
diameter = 6 mm
density = 7800 kg/m^3
[balls.little]
count = 80
diameter = 4 mm
density = 2500 kg/m^3
[drum]
radius = 40 mm
length = 60 mm
profile = wavy
buckles = 8
buckle_height = 4 mm
[rotor]
speed = 1200 rpm
shaft_radius = 10 mm
[blades]
count = 2
tip_radius = 28 mm
width = 11 mm
thickness = 6 mm
pitch = 30 deg
[contact]
restitution = 0.8
friction = 0.3
[output]
impacts = all
"""
GAS = """
[run]
time = 60 ms
sample_from = 10 ms
[balls]
count = 200
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
[drum]
radius = 30 mm
length = 40 mm
[contact]
restitution = 0.9
[output]
frames = 0 s
"""
DECKS = {"plain": PLAIN, "mixture": MIXTURE, "gas": GAS}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Holds plain.h5, mixture.h5 and gas.h5."""
    place = tmp_path_factory.mktemp("figures")
    for name, deck in DECKS.items():
        (place / f"{name}.ini").write_text(deck)
        subprocess.run([PROGRAM, f"{name}.ini", "-q"], cwd=place, check=True, capture_output=True)
    return place


@pytest.fixture(scope="module", params=DECKS)
def run(request, folder):
    with Run(folder / f"{request.param}.h5") as run:
        yield run


@pytest.fixture
def plain(folder):
    with Run(folder / "plain.h5") as run:
        yield run


@pytest.fixture
def mixture(folder):
    with Run(folder / "mixture.h5") as run:
        yield run


@pytest.fixture
def gas(folder):
    with Run(folder / "gas.h5") as run:
        yield run


@pytest.fixture
def plot(folder):
    """plot(*words) is `mill plot *words` in the folder of the runs."""

    def go(*words, cwd=folder):
        return run_mill(cwd, "plot", *words)

    return go


def axes():
    return matplotlib.figure.Figure().subplots()


def near(value):
    return pytest.approx(value, rel=1e-12, nan_ok=True)


# ---- spectra


@pytest.mark.parametrize("abscissa", ["speed", "energy"])
@pytest.mark.parametrize("kind", [*KINDS, "all"])
def test_the_integrals_of_a_spectrum_are_the_totals_of_the_file(run, kind, abscissa):
    if kind not in (*run.kinds, "all"):
        return  # a mill without a rotor
    found = spectra.bins(run, kind, abscissa=abscissa)
    inside = found.count.sum() / found.duration
    assert (found.rate_density * found.decades).sum() == near(inside)
    assert found.rate == near(run.statistic(f"impacts/{kind}/rate"))
    # the log holds the loss of each impact, the histogram sums of them
    power = run.statistic(f"impacts/{kind}/dissipated_power")
    assert found.power == pytest.approx(power, rel=1e-9, abs=1e-12)
    assert found.exceedance[0] == near(found.rate - found.below[0] / found.duration)


@pytest.mark.parametrize("speed", spectra.SPEEDS)
@pytest.mark.parametrize("group", spectra.GROUPS)
def test_normal_and_tangential_spectra_of_impacts_and_strikes_add_up(plain, group, speed):
    found = spectra.bins(plain, "all", group, speed)
    assert found.rate == near(plain.statistic(f"{group}/all/rate"))
    assert found.power == pytest.approx(plain.statistic(f"{group}/all/dissipated_power"), rel=1e-9)


def test_ten_to_twenty_bins_are_drawn_a_decade(plain):
    found = spectra.bins(plain)
    assert 10 <= 1 / found.decades[0] <= 20
    assert np.allclose(found.decades[:-1], found.decades[0])
    for speed in (0.05, 1.0, 20.0):  # what people count above stays an edge
        assert np.isclose(found.edges, speed, rtol=1e-12).any()


def test_impacts_outside_of_the_bins_count():
    histogram = Histogram(np.geomspace(1, 1e3, 31), np.full(30, 2), np.full(30, 0.5), 7, 3, "all", 0.25, 1.5)
    found = bins.merged(histogram, 10.0)
    assert len(found.count) == 4 and found.edges[-1] == pytest.approx(1e3)
    assert found.rate == near((60 + 7 + 3) / 10)
    assert found.power == near((15 + 0.25 + 1.5) / 10)
    assert found.exceedance[-1] == near(0.3) and found.exceedance[0] == near(6.3)


def test_energies_of_equal_balls_are_half_their_effective_mass_times_speed_squared(plain):
    mass = plain.balls("mass")[0]
    for kind, effective in (("ball_ball", mass / 2), ("ball_drum", mass), ("ball_blade", mass)):
        speed, energy = (spectra.bins(plain, kind, abscissa=a) for a in ("speed", "energy"))
        assert np.allclose(energy.edges, effective * speed.edges**2 / 2, rtol=1e-14)
        assert np.array_equal(energy.count, speed.count)


def energies_of_the_log(run):
    """[J] of the ball-ball impacts in the window."""
    mass, (begin, end) = run.balls("mass"), run.window
    log = {name: run.read(f"impacts/{name}") for name in ("time", "kind", "ball", "partner", "normal_speed")}
    kinds = list(run.attribute("impacts", "kinds"))
    return [
        0.5 * mass[i] * mass[j] / (mass[i] + mass[j]) * v * v
        for t, k, i, j, v in zip(*log.values())
        if begin <= t < end and kinds[k] == "ball_ball"
    ]


def test_energies_of_a_mixture_are_those_of_its_impacts(mixture):
    found = energies.bins(mixture, "ball_ball")
    assert np.array_equal(found.count, np.histogram(energies_of_the_log(mixture), found.edges)[0])
    assert found.power == pytest.approx(mixture.statistic("impacts/ball_ball/dissipated_power"))


@pytest.fixture
def without_energies(monkeypatch):
    """Files are as other programs write them."""
    monkeypatch.setattr(energies, "stored", lambda run: False)


def test_energies_of_a_mixture_of_another_program_come_from_the_log(mixture, without_energies):
    found = energies.bins(mixture, "ball_ball")
    assert np.array_equal(found.count, np.histogram(energies_of_the_log(mixture), found.edges)[0])


@pytest.mark.parametrize("group", spectra.GROUPS)
def test_energies_of_all_kinds_of_equal_balls_are_those_of_the_kinds_together(plain, gas, without_energies, group):
    whole, mass = spectra.bins(plain, "all", group, abscissa="energy"), plain.balls("mass")[0]
    parts = [(plain.histogram(kind, group), mass / (2 if kind == "ball_ball" else 1)) for kind in plain.kinds]
    assert whole.total == sum(part.above(0) for part, _ in parts) > 1000
    assert whole.power == pytest.approx(sum(spectra.bins(plain, kind, group).power for kind in plain.kinds))
    for low, rate in zip(whole.edges, whole.exceedance):
        above = sum(part.above(np.sqrt(2 * low / effective)) for part, effective in parts)
        assert rate * plain.duration == pytest.approx(above, abs=float(sum(part.count.max() for part, _ in parts)))
    lines = FIGURES["energies"].draw([plain, gas], strikes=group == "strikes").axes[0].lines
    assert [line.get_label().partition(":")[0] for line in lines if "all" in line.get_label()] == [
        "plain, all",
        "gas, all",
    ]


def test_the_log_is_read_by_slices(mixture, monkeypatch, without_energies):
    whole = energies.bins(mixture, "all")
    monkeypatch.setattr(energies, "SLICE", 100)
    energies._logged.clear()
    shares = []
    energies.read(mixture, shares.append)
    assert len(shares) > 5 and shares == sorted(shares)
    assert np.array_equal(energies.bins(mixture, "all").count, whole.count)


def test_strikes_of_a_mixture_have_no_energies_and_say_why(folder, tmp_path, plot):
    order = [folder / "mixture.h5", "e.svg", "--figure", "energies", "--strikes"]
    done = plot(*order, cwd=tmp_path)
    assert done.returncode == 2 and not (tmp_path / "e.svg").exists()
    assert "different masses" in done.stderr and len(done.stderr.splitlines()) == 1


def test_rates_can_be_asked_above_any_energy_of_any_pair(mixture):
    energy = np.sort(energies_of_the_log(mixture))
    found = mixture.histogram("ball_ball", speed="normal_energy")
    for at in (energy[len(energy) // 2], 1.3e-6, 1e-5):
        assert np.sum(energy >= 1.07 * at) <= found.above(at) <= np.sum(energy >= at / 1.07)
    names = mixture.species_names()
    same = [mixture.histogram("ball_ball", speed="normal_energy", species=(n, n)) for n in names]
    other = mixture.histogram("ball_ball", speed="normal_energy", species=names)
    assert np.array_equal(same[0].count + same[1].count + other.count, found.count)
    one = mixture.histogram("ball_ball", speed="normal_energy", species=names[0])
    assert np.array_equal(one.count, same[0].count + other.count)


@pytest.mark.parametrize("weight", spectra.WEIGHTS)
@pytest.mark.parametrize("abscissa", ["speed", "energy"])
def test_plot_draws_a_line_of_each_kind_with_its_total(plain, weight, abscissa):
    ax = axes()
    lines = spectra.plot(ax, plain, abscissa=abscissa, weight=weight)
    assert len(lines) == len(KINDS)
    for line, kind in zip(lines, KINDS):
        found = spectra.bins(plain, kind, abscissa=abscissa)
        drawn = np.nan_to_num(line.get_ydata())
        if weight == "cumulative":
            assert drawn.max(initial=0) == pytest.approx(found.rate)
        else:
            outside = found.below[1] + found.above[1]  # pressed balls may slip without closing in
            total = found.rate if weight == "count" else found.power - outside
            assert (drawn * found.decades).sum() == pytest.approx(total, rel=1e-9, abs=1e-12)
    unit = "[J]" if abscissa == "energy" else "[m/s]"
    assert ax.get_xlabel().endswith(unit) and "[" in ax.get_ylabel()


def test_plot_leaves_the_settings_of_matplotlib_alone(plain):
    before = dict(matplotlib.rcParams)
    spectra.plot(axes(), plain)
    FIGURES["speeds"].draw(plain)
    assert dict(matplotlib.rcParams) == before


def test_per_ball_divides_by_the_number_of_balls(plain):
    whole, each = (spectra.plot(axes(), plain, per_ball=p)[0].get_ydata() for p in (False, True))
    assert np.allclose(each, whole / 300, equal_nan=True)


@pytest.mark.parametrize("what", [{"kinds": "ball_wal"}, {"weight": "mass"}, {"speed": "v"}, {"group": "hits"}])
def test_plot_names_what_it_knows_where_a_word_is_wrong(plain, what):
    with pytest.raises(UserError, match="unknown .*: one of"):
        spectra.plot(axes(), plain, **what)


# ---- the energy account


def test_the_flow_adds_up_to_the_energy_balance(run):
    found = flow.account(run)
    gives, takes = (sum(p for *_, p in side) for side in (found.sources, found.sinks))
    assert gives == pytest.approx(takes, rel=1e-9)
    assert abs(found.residual) < 1e-9 * found.turnover
    # the powers of the statistics: the window begins and ends at rows here
    for kind, (normal, tangential) in found.dissipation.items():
        power = run.statistic(f"impacts/{kind}/dissipated_power")
        assert normal + tangential == pytest.approx(power, rel=1e-6, abs=1e-9)
    if run.has_rotor:
        assert found.drives["rotor"] == pytest.approx(run.statistic("rotor/power"), rel=1e-9)


def test_a_gas_that_cools_lives_on_its_kinetic_energy(gas):
    found = flow.account(gas)
    assert found.drives == {}
    assert {what for what, *_ in found.sources} <= {"kinetic_energy", "potential_energy"}
    assert found.energies["kinetic_energy"] < 0


def test_negative_losses_and_energies_that_fall_are_sources():
    found = flow.Account(
        (0, 1), {"rotor": 5.0}, {"kinetic_energy": -2.0, "potential_energy": 1.0},
        {"ball_ball": (4.0, 2.0), "ball_drum": (-0.5, 0.25)},
    )  # fmt: skip
    assert found.residual == near(5 + 2 - 1 - 6 + 0.25)
    assert found.turnover == near(5 + 2 + 0.5)
    assert [s[:3] for s in found.sources] == [
        ("rotor", "", ""), ("dissipation", "ball_drum", "normal"), ("kinetic_energy", "", "")
    ]  # fmt: skip
    assert sum(p for *_, p in found.sinks) == near(found.turnover)


def bands(figure, low, high):
    """Heights of the bands that end at x = high, from the top."""
    found = []
    for patch in figure.axes[0].patches:
        if patch.get_label() == "_band":
            points = patch.get_path().vertices
            x = points[:, 0]
            if x.min() == low and x.max() == high:
                found.append(np.ptp(points[x == high][:, 1]))
    return found


def test_widths_of_the_flow_are_true_to_scale(run):
    found = flow.account(run)
    figure = FIGURES["flow"].draw(run)
    assert np.allclose(bands(figure, 0.62, 1.0), [p / found.turnover for *_, p in found.sinks])
    assert np.allclose(bands(figure, 0.0, 0.26), [p / found.turnover for *_, p in found.sources])


def test_flows_of_several_runs_are_on_one_scale_of_watts(monkeypatch):
    powers = {"small.h5": 100.0, "large.h5": 400.0}
    account = lambda run: flow.Account(  # noqa: E731
        (0, 1), {"rotor": powers[run.path]}, {}, {"ball_ball": (0.6 * powers[run.path], 0.4 * powers[run.path])}
    )
    monkeypatch.setattr(flow, "account", account)
    drawing = Canvas()
    FIGURES["flow"].paint(drawing, [SimpleNamespace(path=path, starts=1) for path in powers])
    style.lay_out(drawing)
    trunks = [patch for ax in drawing.axes for patch in ax.patches if isinstance(patch, Rectangle)]
    small, large = (trunk.get_window_extent().height for trunk in trunks)
    assert large / small == pytest.approx(4, rel=1e-3)


def test_labels_of_the_flow_keep_apart():
    places = sankey.spread([0.1, 0.1, 0.11, 0.5, 0.98, 0.99], 0.05, 0, 1)
    assert np.diff(places).min() > 0.05 - 1e-12
    assert places[3] == near(0.5) and max(places) <= 1


@pytest.fixture
def foreign(folder, tmp_path):
    """The plain run as a program leaves it that knows the normal loss of an impact alone, and of the rest no parts."""
    path = tmp_path / "soft.h5"
    path.write_bytes((folder / "plain.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        file["run/program"] = "LIGGGHTS"
        file.visititems(
            lambda name, item: item.attrs.__setitem__("part", "normal") if name.endswith("dissipation") else None
        )
        for kind in KINDS:
            value = file[f"observables/dissipation_normal/{kind}/value"]
            value[:] = np.full(value.shape, np.nan)
    with Run(path) as run:
        yield run


def test_what_another_program_does_not_tell_is_named(foreign):
    for name in ("speeds-power", "energies-power", "axial-power"):
        figure = FIGURES[name].draw(foreign)
        words = " ".join(" ".join(ax.get_ylabel() for ax in figure.axes).split())
        assert "normal part [W" in words
        assert any("normal part" in head for head in FIGURES[name].tables(foreign)[0].columns)
    assert "rebound" not in str(spectra.plot(axes(), foreign)[0].axes.get_legend_handles_labels())
    found = flow.account(foreign)
    assert {part for what, _, part, _ in found.sinks if what == "dissipation"} == {""}
    assert abs(found.residual) < 1e-9 * found.turnover


# ---- maps


@pytest.mark.parametrize("view", maps.VIEWS)
def test_densities_of_the_maps_add_up_to_the_totals(run, view):
    found = maps.field(run, view)
    total = np.nansum(found.values["rate"] * found.volume)
    assert total == pytest.approx(run.statistic("impacts/all/rate"), rel=1e-12)
    power = np.nansum(found.values["power"] * found.volume)
    assert power == pytest.approx(run.statistic("impacts/all/dissipated_power"), rel=1e-9)
    balls = (np.pi / 6 * run.balls("diameter") ** 3).sum()
    assert np.nansum(found.values["solid"] * found.volume) == pytest.approx(balls, rel=1e-3)


@pytest.mark.parametrize("view", maps.VIEWS)
def test_cells_where_nothing_was_are_blank(run, view):
    found = maps.field(run, view)
    for name in ("rate", "impact-speed", "power"):
        assert np.array_equal(np.isnan(found.values[name]), found.count == 0)
    assert not (found.values["solid"] == 0).any()


@pytest.mark.parametrize("name", ["rate", "impact-speed", "power"])
def test_a_cell_of_one_impact_does_not_set_the_scale(plain, name):
    found = maps.field(plain, "axial")
    cells = tuple(np.argwhere((found.count > 0) & (found.count < ENOUGH)).T)
    assert len(cells[0]) and found.count.max() >= ENOUGH
    count, value = found.count.copy(), found.values[name].copy()
    count[cells], value[cells] = 1, 1e9
    odd = dataclasses.replace(found, count=count, values=found.values | {name: value})
    assert maps.limits([odd], name) == maps.limits([found], name)


def test_means_of_too_few_impacts_are_grey(plain):
    found, figure = maps.field(plain, "axial"), FIGURES["axial-impact-speed"].draw(plain)
    grey, shown = (image.get_array().reshape(found.count.T.shape).T for image in figure.axes[0].collections[:2])
    few = (found.count > 0) & (found.count < ENOUGH)
    assert np.array_equal(~np.ma.getmaskarray(np.ma.masked_invalid(grey)), few)
    assert np.array_equal(~np.ma.getmaskarray(np.ma.masked_invalid(shown)), found.count >= ENOUGH)


def test_ticks_of_lengths_are_in_millimetres(plain):
    ax = FIGURES["section-solid"].draw(plain).axes[0]
    ends = [float(ax.xaxis.get_major_formatter()(value, 0).replace("\N{MINUS SIGN}", "-")) for value in ax.get_xlim()]
    assert ends == pytest.approx([1e3 * value for value in ax.get_xlim()], rel=1e-3)
    assert ax.get_xlabel().endswith("[mm]")


@pytest.mark.parametrize("name", ["section-power", "section-solid", "section-velocity"])
def test_a_cross_section_is_drawn_within_the_wall(mixture, name):
    figure = FIGURES[name].draw(mixture)
    ax = figure.axes[0]
    rim = next(p for p in ax.patches if p.get_label() == "_drum")
    wall = contour.of(mixture.as_deck)
    assert abs(wall.gap(rim.get_xy())).max() < 1e-15
    image = ax.collections[0]
    assert image.get_rasterized() and image.get_clip_path() is not None
    edges = mixture.edges()
    corners = np.meshgrid(*edges, indexing="ij")
    outside = wall.gap(np.stack(corners, axis=-1)).reshape(corners[0].shape) < -0.1 * np.ptp(
        edges[0]
    )  # far from the wall
    value = image.get_array().reshape(60, 60).T
    mask = np.ma.getmaskarray(np.ma.masked_invalid(value))
    assert mask[outside[:-1, :-1] & outside[1:, 1:]].all()
    assert ax.get_aspect() == 1
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "y, across the drum's axis [mm]",
        "z, across the drum's axis [mm]",
    )
    assert "grey: the shaft" in FIGURES[name].says([mixture])


def test_the_blades_of_the_outline_reach_as_far_as_their_corners(mixture):
    across = (np.sin(np.pi / 6) * 0.011 + np.cos(np.pi / 6) * 0.006) / 2
    half = (np.cos(np.pi / 6) * 0.011 + np.sin(np.pi / 6) * 0.006) / 2
    (begin, end, reach), _ = outlines.sweeps(mixture)
    assert reach == near(np.hypot(0.028, across))
    assert (begin, end) == (near(-0.015 - half), near(-0.015 + half))


@pytest.mark.slow
def test_several_runs_share_one_scale(folder, plain, gas):
    figure = FIGURES["section-solid"].draw([plain, gas])
    images = [ax.collections[0] for ax in figure.axes[:2]]
    assert images[0].get_clim() == images[1].get_clim()
    assert len(figure.axes) == 3  # one colour bar


# ---- over time


def test_means_of_revolutions_are_those_of_the_series(plain):
    table = pd.DataFrame(FIGURES["power"].tables(plain)[0].columns)
    turns = table[(table["mean over"] == "revolution") & (table["from [s]"] > 0.05 - 1e-9)]
    work = np.interp([*turns["from [s]"], turns["to [s]"].iloc[-1]], *plain.series("rotor_work"))
    assert len(turns) == 2
    assert np.allclose(turns["power [W]"], np.diff(work) / (turns["to [s]"] - turns["from [s]"]), rtol=1e-9)
    window = table[table["mean over"] == "window"].iloc[0]
    assert window["power [W]"] == near(plain.statistic("rotor/power"))
    assert window["standard error [W]"] == near(plain.statistic("rotor/power_error"))


def test_the_torque_is_the_power_over_the_speed_of_the_rotor(plain):
    power, torque = (pd.DataFrame(FIGURES[name].tables(plain)[0].columns) for name in ("power", "torque"))
    assert np.allclose(torque["torque [N m]"] * plain.rotor_speed, power["power [W]"], rtol=1e-6, atol=1e-9)


def test_collision_rates_over_time_add_up_to_the_counts(run):
    table = FIGURES["collisions"].tables(run)[0].columns
    length = table["to [s]"] - table["from [s]"]
    for kind in run.kinds:
        count = run.series(f"collisions/{kind}")[1][-1]
        assert (table[f"{kind} [1/s]"] * length).sum() == pytest.approx(count, rel=1e-9, abs=1e-6)


def test_a_long_series_is_drawn_in_few_intervals():
    times = np.arange(100_001) * 1e-3
    bounds = overtime.intervals(times)
    assert len(bounds) <= 301 and (bounds[0], bounds[-1]) == (0, times[-1])


HEAD_ON = """
[run]
time = 50 ms
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = 2
diameter = 5 mm
density = 7800 kg/m^3
start = two.txt
[drum]
radius = 30 mm
length = 40 mm
[contact]
restitution = 1
"""


def test_a_slip_of_nothing_has_no_spectrum(tmp_path):
    (tmp_path / "deck.ini").write_text(HEAD_ON)
    (tmp_path / "two.txt").write_text("-0.01 0 0 1 0 0\n0.01 0 0 -1 0 0\n")
    subprocess.run([PROGRAM, "deck.ini", "-q"], cwd=tmp_path, check=True, capture_output=True)
    with Run(tmp_path / "deck.h5") as run:
        assert FIGURES["speeds"].why_not(run) is None
        assert "slower or faster than the bins" in FIGURES["slip"].why_not(run)
        assert spectra.bins(run, "all", speed="tangential_speed").rate == near(run.statistic("impacts/all/rate"))
        spectra.plot(axes(), run, speed="tangential_speed")  # empty, but no fault


def test_spectra_of_a_species_have_its_impacts_with_itself_once():
    run = SimpleNamespace(read=lambda path, why: np.arange(12).reshape(2, 2, 3))
    assert _of_pairs(run, "ball_ball/normal", [0]).tolist() == [9, 12, 15]


# ---- layout


@pytest.mark.parametrize(
    "name",
    slow([*ANY, "overview"], *(name for name in FIGURES if name[:4] in ("axia", "sect", "wear")), "overview"),
)
def test_no_text_is_cut_off_and_none_covers_another(folder, plain, gas, name):
    path = folder / f"{'a_name_without_an_end_' * 2}, then $x_2$ and more words.h5"
    path.unlink(missing_ok=True)
    path.symlink_to("mixture.h5")
    with Run(path) as long:
        both = [long, plain if name in ("power", "torque") else gas]  # nothing moves in the gas
        for runs in [both] if name.startswith("wear") else [[long], both][: 1 + (name in FIGURES)]:
            assert not layouts.faults(FIGURES[name].draw(runs) if name in FIGURES else overview.draw(long))


# ---- inline SVG


@pytest.mark.parametrize("name", slow(ANY, "wear", "wear-normal"))
def test_inline_svg_is_well_formed_and_stands_alone(plain, name):
    text = figures.svg(FIGURES[name].draw(plain), f"fig-{name}")
    root = ET.fromstring(text)
    assert root.tag.endswith("svg") and "viewBox" in root.attrib
    assert len(text) < (300_000 if FIGURES[name].group == "maps" else 150_000)
    tags = {e.tag.split("}")[1] for e in root.iter()}
    assert "text" in tags and not tags & {"script", "foreignObject", "metadata", "a"}
    for element in root.iter():
        for key, value in element.attrib.items():
            if key.endswith("href"):
                assert value.startswith(("#fig-", "data:image/png;base64,"))
                if value.startswith("data:"):  # the field of a map
                    pixels = int.from_bytes(base64.b64decode(value[22:])[16:20])
                    assert pixels == pytest.approx(float(element.attrib["width"]) * inline.DPI / 72, abs=2)
            assert not key.lower().startswith("on")
    ids = [e.attrib["id"] for e in root.iter() if "id" in e.attrib]
    assert len(ids) == len(set(ids)) and all(i.startswith(f"fig-{name}-") for i in ids)
    for target in re.findall(r"url\(#([^)]*)\)", text):
        assert target in ids
    words = " ".join(root.itertext())
    if name != "flow":
        assert re.search(r"\[[^\]]+\]", words), "an axis without a unit"
    assert "currentColor" in text and "#1a1a1a" not in text and "#ffffff" not in text


def test_the_same_figure_is_the_same_svg(plain):
    one, two = (figures.svg(FIGURES["section-rate"].draw(plain), "a") for _ in range(2))
    assert one == two


def test_a_name_with_markup_stays_text(folder, tmp_path):
    path = tmp_path / "<script>alert(1)<|script>&$x^2$.h5"
    path.symlink_to(folder / "plain.h5")
    with Run(path) as run:
        text = figures.svg(FIGURES["speeds"].draw(run), "a")
    assert "<script" not in text
    assert "<script>alert(1)<|script>&$x^2$" in " ".join(ET.fromstring(text).itertext())


def test_a_prefix_must_be_an_id(plain):
    with pytest.raises(ValueError, match="prefix"):
        figures.svg(FIGURES["energy"].draw(plain), 'a"b')


# ---- the command


@pytest.mark.slow
@pytest.mark.parametrize("suffix, begin", [("svg", b"<?xml"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_a_figure_becomes_a_file_of_the_names_format(plot, tmp_path, suffix, begin):
    target = tmp_path / f"a.{suffix}"
    done = plot("plain.h5", target, "--figure", "speeds")
    assert (done.returncode, done.stderr) == (0, "")
    assert target.read_bytes().startswith(begin)
    again = tmp_path / f"b.{suffix}"
    plot("plain.h5", again, "--figure", "speeds")
    assert target.read_bytes() == again.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2  # nothing beside them


def test_the_csv_holds_the_numbers_drawn(plot, tmp_path, plain):
    assert plot("plain.h5", tmp_path / "a.csv", "--figure", "speeds").returncode == 0
    table = pd.read_csv(tmp_path / "a.csv")
    line = spectra.plot(axes(), plain, kinds="ball_drum")[0]
    rows = table[table["kind"] == "ball_drum"]
    drawn = line.get_ydata()[np.isfinite(line.get_ydata())]
    density = rows["impacts per second and decade [1/s]"]
    assert np.array_equal(density[density > 0], drawn)
    assert rows["impacts per second [1/s]"].sum() == near(plain.statistic("impacts/ball_drum/rate"))
    power = plain.statistic("impacts/ball_drum/dissipated_power")
    assert rows["dissipated power [W]"].sum() == pytest.approx(power, rel=1e-9)
    edges = rows["speed from [m/s]"].to_numpy(), rows["speed to [m/s]"].to_numpy()
    assert np.array_equal(edges[0][1:], edges[1][:-1]) and edges[0][0] == 0 and edges[1][-1] == np.inf


def test_the_csv_of_a_map_is_the_map(plot, tmp_path, plain):
    assert plot("plain.h5", tmp_path / "a.csv", "--figure", "axial-rate").returncode == 0
    table = pd.read_csv(tmp_path / "a.csv")
    total = (table["impacts per time and volume [1/(m3 s)]"] * table["volume in the container [m3]"]).sum()
    assert total == pytest.approx(plain.statistic("impacts/all/rate"), rel=1e-12)
    assert table["impacts per time and volume [1/(m3 s)]"].isna().equals(table["impacts [1]"] == 0)


def test_the_csv_of_several_runs_names_them(plot, tmp_path):
    done = plot("plain.h5", "gas.h5", tmp_path / "a.csv", "--figure", "energy")
    assert done.returncode == 0, done.stderr
    assert list(pd.read_csv(tmp_path / "a.csv")["run"].unique()) == ["plain", "gas"]


def test_every_csv_has_units_in_its_heads(run):
    for figure in FIGURES.values():
        if figure.why_not(run) is None:
            for table in figure.tables(run):
                texts = [h for h, v in table.columns.items() if np.asarray(v).dtype.kind == "U"]
                heads = set(table.columns) - set(texts)
                assert all(re.search(r"\[[^\]]+\]$", head) for head in heads), figure.name
                assert len({len(v) for v in table.columns.values()}) == 1


def test_list_names_the_figures_and_why_a_run_has_not(plot):
    done = plot("--list", "gas.h5")
    assert done.returncode == 0
    for name, figure in FIGURES.items():
        assert re.search(rf"^{name} +{re.escape(figure.title)}$", done.stdout, re.M)
    assert "not for gas.h5: nothing moves in this mill" in done.stdout


@pytest.mark.parametrize(
    "words, says",
    [
        (["plain.h5", "a.svg", "--figure", "speed"], "unknown figure 'speed': one of "),
        (["plain.h5", "a.gif", "--figure", "speeds"], "a.gif: expected a name that ends in"),
        (["gas.h5", "a.svg", "--figure", "power"], "gas.h5: no figure 'power': nothing moves in this mill"),
        (["gas.h5", "a.svg", "--figure", "speeds", "--kind", "ball_blade"],
         "unknown contact kind 'ball_blade': one of ball_ball, ball_drum, ball_wall, all"),
        (["plain.h5", "a.svg", "--figure", "speeds", "--kind", "blade"], "unknown contact kind 'blade'"),
        (["plain.h5", "a.svg", "--figure", "flow", "--kind", "ball_ball"], "has no option"),
        (["plain.h5", "gas.h5", "a.png"], "without --figure only one run can be drawn"),
        (["plain.h5", "a.csv"], "without --figure only one run can be drawn, without options"),
        (["plain.h5"], "expected a run and the name of the picture to write"),
        (["nothing.h5", "a.svg", "--figure", "speeds"], "nothing.h5: no such file"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_is_one_line(folder, words, says, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    monkeypatch.setattr("sys.argv", ["mill", "plot", *words])
    assert main() == 2
    said = capsys.readouterr().err
    assert said.startswith("mill plot: ") and says in said
    assert len(said.splitlines()) == 1
    assert not list(folder.glob("a.*"))


@pytest.mark.slow
def test_a_missing_folder_is_an_outside_fault(plot, tmp_path):
    done = plot("plain.h5", tmp_path / "no" / "a.svg", "--figure", "speeds")
    assert done.returncode == 1
    assert done.stderr.strip().endswith("No such file or directory")


# one of each sort
SORTS = (
    "flow", "speeds", "speeds-power", "slip-exceedance", "energies", "section-power", "axial-velocity", "power",
    "energy", "collisions",
)  # fmt: skip


def drawn_or_not(path):
    """Names of the figures that a run has; the others must give one clear reason."""
    found = []
    with Run(path) as run:
        for name in SORTS:
            figure = FIGURES[name]
            why = figure.why_not(run)
            if why is None:
                assert figure.draw(run).axes
                assert figure.tables(run)[0].columns
                found.append(name)
                continue
            assert "\n" not in why
            with pytest.raises(UserError, match=re.escape(why)):
                figure.draw(run)
    return found


@pytest.mark.parametrize(
    "options, missing",
    [
        (["run.sample_from=49.9 ms"], None),  # hardly anything
        (["balls.count=1"], None),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                (["contact.restitution=1", "contact.friction=0", "contact.rebound_floor=0 m/s"], None),
                (["output.series=0.2 s"], {"flow", "power", "energy", "collisions"}),  # one row
                (["rotor.speed=0 rpm"], None),
            )
        ),
    ],
)
def test_each_figure_of_an_odd_run_is_drawn_or_says_why_not(tmp_path, options, missing):
    (tmp_path / "deck.ini").write_text(SMALL)
    sets = [word for option in options for word in ("-s", option)]
    subprocess.run([PROGRAM, "deck.ini", "-q", *sets], cwd=tmp_path, check=True, capture_output=True)
    found = drawn_or_not(tmp_path / "deck.h5")
    assert missing is None or set(SORTS) - set(found) == missing


@pytest.mark.slow
def test_a_run_stopped_before_its_window_has_what_goes_over_time(tmp_path):
    (tmp_path / "deck.ini").write_text(SMALL.replace("time = 50 ms", "time = 9 h\nsample_from = 8 h"))
    running = subprocess.Popen(
        [PROGRAM, "deck.ini", "-q", "-s", "output.checkpoint=0.1 s"], cwd=tmp_path,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        for _ in range(600):  # the first checkpoint may have nothing in it
            if (tmp_path / "deck.h5").exists():
                with Run(tmp_path / "deck.h5") as run:
                    if run.time > 0.05:
                        break
            time.sleep(0.05)
        running.send_signal(signal.SIGINT)
        running.wait(60)
    finally:
        running.kill()
    assert set(drawn_or_not(tmp_path / "deck.h5")) == {"power", "energy", "collisions"}
