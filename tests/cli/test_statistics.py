"""/statistics, made again by numpy from /impacts, /particles and /observables; the summary against the file."""

import json
import re
import subprocess

import h5py
import numpy as np
import pytest
from conftest import PROGRAM

KINDS = ["ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade"]
ROWS = [*KINDS, "all"]
SPEEDS = ["normal_speed", "tangential_speed"]
BIN = 20 ** (1 / 152)

# Four revolutions sampled; frames at twice the rate of the maps' snapshots, so that they include them;
# a strike window so wide that a good part of the contacts is merged.
BEGIN, END, WINDOW, FLOOR, RESTITUTION = 0.02, 0.22, 1e-3, 0.01, 0.8
RADIUS, LENGTH = 0.05, 0.06
DECK = f"""
[run]
time = {END} s
sample_from = {BEGIN} s
seed = 3
[balls.big]
count = 200
diameter = 6 mm
density = 7800 kg/m^3
[balls.little]
count = 200
diameter = 4 mm
density = 2500 kg/m^3
[drum]
radius = {RADIUS} m
length = {LENGTH} m
[rotor]
speed = 1200 rpm
shaft_radius = 19 mm
[blades]
count = 2
tip_radius = 33 mm
width = 11 mm
thickness = 6 mm
[contact]
restitution = {RESTITUTION}
friction = 0.3
tangential_restitution = 0.4
rebound_floor = {FLOOR} m/s
[output]
frames = 0.5 ms
series = 1 ms
impacts = all
strike_window = {WINDOW} s
"""


def simulate(folder, name, *options):
    deck = folder / "mill.ini"
    deck.write_text(DECK)
    done = subprocess.run(
        [PROGRAM, "-q", "-o", name, *options, deck],
        cwd=folder, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("statistics")


@pytest.fixture(scope="module")
def summary(folder):
    """The JSON of the run whose file is mill.h5."""
    return json.loads(simulate(folder, "mill.h5", "--json"))


@pytest.fixture(scope="module")
def file(folder, summary):
    with h5py.File(folder / "mill.h5") as opened:
        yield opened


@pytest.fixture(scope="module")
def log(file):
    """Every impact from t = 0, as arrays; `inside` tells those in the window."""
    columns = {name: file["impacts"][name][:] for name in file["impacts"]}
    columns["inside"] = (columns["time"] >= BEGIN) & (columns["time"] < END)
    return columns


def merge(log, window):
    """Strikes by brute force: index of the strike's first impact for every impact."""
    first, last, head = {}, {}, np.arange(len(log["time"]))
    pairs = zip(log["kind"].tolist(), log["ball"].tolist(), log["partner"].tolist())
    for i, (pair, time) in enumerate(zip(pairs, log["time"].tolist())):
        if pair in last and time - last[pair] < window:
            head[i] = first[pair]
        else:
            first[pair] = i
        last[pair] = time
    return head


@pytest.fixture(scope="module")
def families(log):
    """impacts and strikes as {kind, normal_speed, tangential_speed, dissipation} of what is counted."""
    names = ["kind", *SPEEDS, "dissipation"]
    impacts = {name: log[name][log["inside"]] for name in names}
    head = merge(log, WINDOW)
    loss = np.zeros(len(head))
    np.add.at(loss, head[log["inside"]], log["dissipation"][log["inside"]])
    new = log["inside"] & (head == np.arange(len(head)))
    strikes = {name: log[name][new] for name in names}
    strikes["dissipation"] = loss[new]
    return {"impacts": impacts, "strikes": strikes}


def members(family, row):
    """Those of one row."""
    chosen = slice(None) if row == "all" else family["kind"] == KINDS.index(row)
    return {name: values[chosen] for name, values in family.items()}


def test_the_run_is_worth_looking_at(log, families):
    count = np.bincount(log["kind"][log["inside"]], minlength=5)
    assert count.min() > 100, dict(zip(KINDS, count))
    assert 0.05 < 1 - len(families["strikes"]["kind"]) / len(families["impacts"]["kind"]) < 0.9
    head = merge(log, WINDOW)
    assert np.any(log["inside"] & ~log["inside"][head])  # strikes that began before the window


def test_the_duration_is_that_of_the_deck(file):
    assert file["statistics/duration"][()] == END - BEGIN


@pytest.mark.parametrize("family", ["impacts", "strikes"])
@pytest.mark.parametrize("row", ROWS)
class TestRows:
    def test_count_rate_and_power_are_those_of_the_log(self, file, families, family, row):
        mine, theirs = members(families[family], row), file[f"statistics/{family}/{row}"]
        assert theirs["count"][()] == len(mine["kind"])
        assert theirs["rate"][()] == pytest.approx(len(mine["kind"]) / (END - BEGIN), rel=1e-12)
        power = mine["dissipation"].sum() / (END - BEGIN)
        assert theirs["dissipated_power"][()] == pytest.approx(power, rel=1e-10)
        if family == "impacts":
            told, lost = file["statistics/precision"], file["observables/dissipation_normal"]
            fast = [np.sum(mine["normal_speed"] >= limit) for limit in (0.5, 1, 2)]
            normal = sum(
                lost[kind]["value"][-1] - lost[kind]["value"][20] for kind in (KINDS if row == "all" else [row])
            )
            for name, value in (("fast_rate", fast), ("dissipated_power_normal", normal)):
                assert told[f"{name}/{row}/value"][()] * (END - BEGIN) == pytest.approx(value, rel=1e-9)
            assert list(told[f"fast_rate/{row}/value"].attrs["thresholds"]) == [0.5, 1, 2]
            assert told[f"rate/{row}/value"][()] == theirs["rate"][()]
            assert told[f"dissipated_power/{row}/value"][()] == pytest.approx(power, rel=1e-9)

    @pytest.mark.parametrize("speed", SPEEDS)
    def test_histograms_are_those_of_the_log(self, file, families, family, row, speed):
        mine = members(families[family], row)
        theirs = file[f"statistics/{family}/{row}/{speed}/histogram"]
        edges = theirs["edges"][:]
        count = np.histogram(mine[speed], edges)[0]
        loss = np.histogram(mine[speed], edges, weights=mine["dissipation"])[0]
        assert np.array_equal(theirs["count"][:], count)
        assert np.allclose(theirs["dissipation"][:], loss, rtol=1e-9, atol=1e-15)
        assert theirs["count"].attrs["underflow"] == np.sum(mine[speed] < edges[0])
        assert theirs["count"].attrs["overflow"] == np.sum(mine[speed] >= edges[-1])
        for name in ("count", "dissipation"):
            total = len(mine["kind"]) if name == "count" else mine["dissipation"].sum()
            outside = sum(theirs[name].attrs[end] for end in ("underflow", "overflow"))
            assert theirs[name][:].sum() + outside == pytest.approx(total, rel=1e-10)

    @pytest.mark.parametrize("speed", SPEEDS)
    def test_means_medians_and_quantiles_are_those_of_the_log(self, file, families, family, row, speed):
        mine, theirs = members(families[family], row), file[f"statistics/{family}/{row}/{speed}"]
        fast = mine[speed][mine["normal_speed"] >= theirs.file["statistics/above_floor"][()]]
        levels = theirs["quantiles"].attrs["levels"]
        assert np.allclose(levels, [0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 0.999])
        assert theirs["mean"][()] == pytest.approx(mine[speed].mean(), rel=1e-10)
        for values, suffix in ((mine[speed], ""), (fast, "_above_floor")):
            exact = np.quantile(values, levels, method="inverted_cdf")
            ratio = theirs["quantiles" + suffix][:] / exact
            assert np.all((ratio > 1 / BIN) & (ratio < BIN)), ratio
            assert theirs["median" + suffix][()] == theirs["quantiles" + suffix][4]


def test_the_bins_are_logarithmic_and_50_mm_per_s_is_an_edge(file):
    edges = file["statistics/impacts/all/normal_speed/histogram/edges"][:]
    assert np.allclose(edges[1:] / edges[:-1], BIN, rtol=1e-12)
    assert 0.05 in edges and 1 in edges and BIN < 1.02


@pytest.mark.parametrize("row", ROWS)
def test_the_floor_share_is_that_of_the_log(file, families, row):
    speed = members(families["impacts"], row)["normal_speed"]
    share, plain = file[f"statistics/floor_share/{row}"][()], np.mean(RESTITUTION * speed < FLOOR)
    if row in ("ball_ball", "all"):  # in bursts the floor is three times as high
        assert plain < share < np.mean(RESTITUTION * speed < 3 * FLOOR)
    else:
        assert share == plain


# ---- maps ----


def axes(file, name):
    group = file[f"statistics/maps/{name}"]
    return [group[f"{axis}_edges"][:] for axis in ("yz" if name == "cross_section" else "xr")]


def coordinates(name, position):
    x, y, z = np.moveaxis(position.astype(float), -1, 0)
    return (y, z) if name == "cross_section" else (x, np.hypot(y, z))


def cells(edges, points):
    """Numbers of the cells (points beyond the rim go to the rim), and which points are too near an edge to
    tell in single precision."""
    number, near = 0, False
    for edge, at in zip(edges, points):
        place = np.clip(np.searchsorted(edge, at, side="right") - 1, 0, len(edge) - 2)
        fence = np.concatenate([[-np.inf], edge[1:-1], [np.inf]])
        near |= np.minimum(at - fence[place], fence[place + 1] - at) < 2e-8
        number = number * (len(edge) - 1) + place
    return number, near


@pytest.mark.parametrize("name", ["cross_section", "axial"])
def test_the_maps_of_impacts_are_those_of_the_log(file, log, name):
    edges, group = axes(file, name), file[f"statistics/maps/{name}"]
    number, near = cells(edges, coordinates(name, log["position"][log["inside"]]))
    speed, loss = log["normal_speed"][log["inside"]], log["dissipation"][log["inside"]]
    assert near.sum() < 100
    size = group["impact_count"].size
    for field, weight in (
        ("impact_count", None),
        ("normal_speed_sum", speed),
        ("dissipation", loss),
    ):
        mine = np.bincount(number, weight, size)
        theirs = group[field][:].ravel().astype(float)
        of_doubt = near.sum() if weight is None else np.abs(weight[near]).sum()
        assert np.abs(mine - theirs).sum() <= 2 * of_doubt + 1e-9 * np.abs(mine).sum()
        assert theirs.sum() == pytest.approx(mine.sum(), rel=1e-10)


def lattice():
    """32 points of a cubic lattice in the unit ball with its second moment, 1/5 along each axis."""
    grid = np.stack(np.meshgrid(*[[-3, -1, 1, 3]] * 3, indexing="ij"), -1).reshape(-1, 3)
    points = grid[(np.abs(grid) == 3).sum(axis=1) <= 1] * np.sqrt(1 / 15)
    assert len(points) == 32 and np.allclose((points**2).mean(axis=0), 0.2)
    return points


@pytest.fixture(scope="module")
def snapshots(file):
    """Positions and velocities of all balls at the times of the maps' snapshots."""
    balls = file["particles/trajectory"]
    time = balls["position/time"][:]
    wanted = BEGIN + (np.arange(200) + 0.5) * 1e-3
    rows = np.searchsorted(time, wanted - 1e-9)
    assert np.allclose(time[rows], wanted, atol=1e-9)
    return balls["position/value"][:][rows].astype(float), balls["velocity/value"][:][rows]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cross_section", "axial"])
def test_the_maps_of_the_flow_are_those_of_the_frames(file, snapshots, name):
    edges, group = axes(file, name), file[f"statistics/maps/{name}"]
    r, v = snapshots
    radius = file["particles/trajectory/diameter"][:] / 2
    assert file["statistics/maps/samples"][()] == len(r) == 200
    c, s = r[..., 1:2], r[..., 2:3]
    c, s = c / np.hypot(c, s), s / np.hypot(c, s)
    offset = lattice() * radius[:, None, None]
    if name == "axial":  # there the lattice is turned: its axes are x, r and phi
        ox, out, around = np.moveaxis(offset, -1, 0)
        offset = np.stack([ox + 0 * c, out * c - around * s, out * s + around * c], -1)
    points = r[:, :, None, :] + offset
    weight = np.broadcast_to((4 / 3 * np.pi * radius**3 / 32)[:, None], points.shape[:-1])
    v = np.broadcast_to(v[:, :, None, :], points.shape)
    if name == "axial":
        y, z = points[..., 1], points[..., 2]
        here = np.hypot(y, z)
        v = np.stack(
            [
                v[..., 0],
                (v[..., 1] * y + v[..., 2] * z) / here,
                (v[..., 2] * y - v[..., 1] * z) / here,
            ],
            -1,
        )
    number, near = cells(edges, coordinates(name, points))
    assert near.mean() < 1e-3
    shape = group["solid_fraction"].shape
    volume = np.bincount(number.ravel(), weight.ravel(), np.prod(shape))
    room = rooms(name, edges)
    mine = volume / room / 200
    theirs = group["solid_fraction"][:].ravel()
    doubt = np.bincount(number.ravel(), (weight * near).ravel(), np.prod(shape))
    doubt = sum(np.roll(doubt, n) for n in (0, 1, -1, shape[1], -shape[1]))
    sure = (doubt == 0) & (room > 0.01 * np.nanmax(room))
    assert sure.sum() > 0.5 * sure.size
    assert np.allclose(theirs[sure], mine[sure], rtol=1e-3, atol=1e-12)
    whole = sure if name == "axial" else sure & uncut(edges).ravel()
    assert np.allclose(theirs[whole], mine[whole], rtol=1e-9, atol=1e-12)
    assert np.mean(theirs[whole] > 0) > 0.5
    letters = "xyz" if name == "cross_section" else ["x", "r", "phi"]
    for k, letter in enumerate(letters):
        flow = np.bincount(number.ravel(), (weight * v[..., k]).ravel(), np.prod(shape))
        theirs = group[f"velocity_{letter}"][:].ravel()
        assert np.array_equal(np.isnan(theirs[sure]), volume[sure] == 0)
        held = sure & (volume > 0)
        assert np.allclose(theirs[held], flow[held] / volume[held], rtol=1e-5, atol=1e-5)


def test_cells_outside_the_drum_have_no_solid_fraction(file):
    y, z = axes(file, "cross_section")
    near_y, near_z = (np.maximum(0, np.maximum(e[:-1], -e[1:])) for e in (y, z))
    nearest = np.hypot(near_y[:, None], near_z[None, :]) / RADIUS
    missing = np.isnan(file["statistics/maps/cross_section/solid_fraction"][:])
    assert np.all(missing[nearest > 1 - 1e-9])
    assert not np.any(missing[nearest < 1 - 1e-3])


def uncut(edges):
    """Which cells of the cross-section lie inside the drum with all four corners."""
    y, z = (np.maximum(np.abs(e[1:]), np.abs(e[:-1])) for e in edges)
    return np.hypot(y[:, None], z[None, :]) <= RADIUS * (1 - 1e-12)


def rooms(name, edges):
    """Volume of every cell inside the drum: rings in closed form, cut squares by fine strips."""
    a, b = edges
    if name == "axial":
        return (np.diff(a)[:, None] * np.pi * np.diff(b**2)[None, :]).ravel()
    strips = 2000
    y = a[:-1, None] + np.diff(a)[:, None] * (np.arange(strips) + 0.5) / strips
    half = np.sqrt(RADIUS**2 - y**2)
    high = np.clip(half[:, None, :], b[:-1, None], b[1:, None])
    low = np.clip(-half[:, None, :], b[:-1, None], b[1:, None])
    area = (high - low).mean(axis=-1) * np.diff(a)[:, None]
    return np.where(area > 0, area, np.nan).ravel() * LENGTH


def test_the_cells_of_the_maps_fill_the_drum(file):
    for name in ("cross_section", "axial"):
        assert np.nansum(rooms(name, axes(file, name))) == pytest.approx(np.pi * RADIUS**2 * LENGTH, rel=1e-4)


# ---- rotor ----


def test_power_is_the_work_of_the_series(file):
    rotor, series = file["statistics/rotor"], file["observables/rotor_work"]
    work = dict(zip(np.round(series["time"][:] * 1e3).astype(int), series["value"][:]))
    assert rotor["power"][()] == pytest.approx((work[220] - work[20]) / 0.2, rel=1e-9)
    assert rotor["power"][()] > 0


def test_power_is_torque_times_speed(file):
    rotor, speed = file["statistics/rotor"], 1200 * 2 * np.pi / 60
    for name in ("", "_error"):
        assert rotor[f"power{name}"][()] == pytest.approx(rotor[f"torque{name}"][()] * speed, rel=1e-9, nan_ok=True)


def test_a_threshold_that_slow_impacts_reach_lowers_the_automatic_floor(folder):
    """4 mm balls in a drum at 5 g of its blades: 33 mm/s, or a sixth of the speed of the heaviest ball at a wall."""
    found = []
    for sets in ([], ["run.hard_impact=2 uJ"], ["run.hard_impact=1 J"], ["run.hard_impact=1e-6 uJ"]):
        words = [word for one in ("contact.rebound_floor=auto", "run.time=30 ms", *sets) for word in ("-s", one)]
        simulate(folder, "floor.h5", "--force", *words)
        with h5py.File(folder / "floor.h5") as file:
            found.append(file["run/rebound_floor"][()])
            heaviest = file["particles/trajectory/mass"][:].max()
    assert found[0] == found[2] and found[3] == pytest.approx(5e-3)
    assert found[1] == pytest.approx(np.sqrt(2 * 2e-6 / heaviest) / 6) and found[1] < found[0]


# ---- the file and the summary ----


def test_every_dataset_has_a_unit_and_a_description(file):
    def look(name, item):
        if isinstance(item, h5py.Dataset):
            assert item.attrs["unit"] or item.dtype.kind == "O", name
            assert len(item.attrs["description"]) > 10, name

    file["statistics"].visititems(look)


def equal(a, b):
    a = a.decode() if isinstance(a, bytes) else a
    return (b is None and np.isnan(a)) or a == b


def test_the_json_summary_holds_the_numbers_of_the_file(file, summary):
    checked = 0

    def compare(group, tree):
        nonlocal checked
        for key, value in tree.items():
            if isinstance(value, dict):
                compare(group[key], value)
            elif isinstance(value, list):
                assert all(map(equal, group[key][:], value)), (group.name, key)
                checked += len(value)
            else:
                assert equal(group[key][()], value), (group.name, key)
                checked += 1

    tree = dict(summary["statistics"])
    levels = tree.pop("quantile_levels")
    assert levels == list(file["statistics/impacts/all/normal_speed/quantiles"].attrs["levels"])
    compare(file["statistics"], tree)
    assert checked > 12 * 2 * 23
    run = summary["run"]
    for key in ("not_closing", "reliefs", "overlaps", "largest_overlap", "energy_turnover",
                "energy_balance_error"):  # fmt: skip
        assert run[key] == file["run"][key][()], key
    for kind in KINDS:
        assert run["collisions"][kind] == file[f"run/events/collisions/{kind}"][()]
        assert run["floored"][kind] == file[f"run/floored/{kind}"][()]
    assert summary["time"] == END and summary["stopped"] is False
    assert run["rotor_work"] == file["observables/rotor_work/value"][-1]
    assert run["kinetic_energy"] == pytest.approx(file["observables/kinetic_energy/value"][-1], rel=1e-12)


def test_the_table_holds_the_numbers_of_the_file(folder, file):
    table = simulate(folder, "again.h5")
    lines = table.splitlines()
    assert [line for line in lines[:-1] if len(line) > 80 and str(folder) not in line] == []
    for row in ROWS:
        fields = next(line for line in lines if line.startswith(row + " ")).split()
        assert int(fields[1]) == file[f"statistics/impacts/{row}/count"][()]
    power = file["statistics/rotor/power"][()]
    shown = re.search(r"rotor power +([\d.]+) \+- ([\d.]+) W, ([\d.]+) \+- ([\d.]+) W/kg of balls", table)
    assert float(shown[1]) == pytest.approx(power, rel=1e-2)
    error = file["statistics/rotor/power_error"][()]
    assert float(shown[2]) == pytest.approx(error, rel=1e-2)
    told = file["statistics/precision"]
    line = next(line for line in lines if line.startswith("hard impacts"))
    assert line.endswith(" uJ or more: half the losses")
    assert f" {1e6 * file['statistics/hard_energy'][()]:.4g} uJ " in line
    assert ("+-" in line) == np.isfinite(told["hard_rate/standard_error"][()]), line
    assert "(4 revolutions)" in table and "anomalies: none" in table
    assert lines[-1].startswith("millsim ") and f"{END} s in" in lines[-1]


def same(a, b):
    """Two files' /statistics bit by bit."""
    names = []
    a["statistics"].visit(names.append)
    for name in names:
        if isinstance(a["statistics"][name], h5py.Dataset):
            x, y = a["statistics"][name][()], b["statistics"][name][()]
            assert x == y if isinstance(x, bytes) else np.array_equal(x, y, equal_nan=True), name
    return len(names)


def test_no_output_option_changes_the_statistics(folder, file):
    simulate(folder, "bare.h5", "-s", "output.frames=0 s", "-s", "output.series=10 ms",
             "-s", "output.impacts=statistics")  # fmt: skip
    with h5py.File(folder / "bare.h5") as other:
        assert same(file, other) > 100


def test_without_a_strike_window_strikes_are_impacts(folder, file):
    simulate(folder, "apart.h5", "-s", "output.strike_window=0 s", "-s", "output.impacts=statistics")
    with h5py.File(folder / "apart.h5") as other:
        for path in ("count", "normal_speed/histogram/count", "tangential_speed/quantiles"):
            strikes = other[f"statistics/strikes/all/{path}"][()]
            assert np.array_equal(strikes, file[f"statistics/impacts/all/{path}"][()])


def test_a_mill_without_a_rotor_tells_nothing_of_one_and_nan_where_there_is_nothing_to_average(tmp_path):
    deck = tmp_path / "still.ini"
    deck.write_text(
        "[run]\ntime = 10 ms\n[balls]\ncount = 2\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
        "[drum]\nradius = 50 mm\nlength = 50 mm\n[contact]\nrestitution = 0.8\n"
    )
    done = subprocess.run(
        [PROGRAM, "--json", "-q", deck],
        cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)["statistics"]
    kinds = ["ball_ball", "ball_drum", "ball_wall"]
    assert list(result["impacts"]) == [*kinds, "all"]
    assert result["impacts"]["ball_ball"]["count"] == 0
    assert result["impacts"]["ball_ball"]["rate"] == 0
    assert result["impacts"]["ball_ball"]["normal_speed"]["median"] is None
    assert result["drive"]["power"] == 0
    assert result["drive"]["power_error"] is None
    assert "rotor_work" not in done.stdout
    with h5py.File(tmp_path / "still.h5") as f:
        assert np.isnan(f["statistics/floor_share/ball_ball"][()])
        for listed in ("run/floored", "run/events/collisions", "observables/collisions", "observables/dissipation"):
            assert list(f[listed]) == kinds
        for listed in ("statistics/impacts", "statistics/strikes", "statistics/precision/rate"):
            assert list(f[listed]) == ["all", *kinds]
        names = []
        f.visit(names.append)
        assert not [name for name in names if "rotor" in name or "shaft" in name or "blade" in name]


# ---- energies by pair of species


@pytest.fixture(scope="module")
def energies(file, log):
    """{name: energy [J] of every impact}, from the log and the masses of the balls."""
    mass, ball, partner = file["particles/trajectory/mass"][:], log["ball"], log["partner"]
    pair = log["kind"] == 0
    reduced = np.where(pair, mass[ball] * mass[partner] / (mass[ball] + mass[partner]), mass[ball])
    normal, slip = log["normal_speed"] ** 2, log["tangential_speed"] ** 2
    return {
        "normal": 0.5 * reduced * normal,
        "total": 0.5 * reduced * (normal + slip),
        "dissipated": log["dissipation"],
    }


@pytest.mark.parametrize("name", ["normal", "total", "dissipated"])
@pytest.mark.parametrize("kind", KINDS)
def test_energies_of_each_pair_of_species_are_those_of_the_log(file, log, energies, kind, name):
    species, edges = file["particles/trajectory/species"][:], file["statistics/energies/edges"][:]
    found = file[f"statistics/energies/{kind}/{name}"][:]
    ours = log["inside"] & (log["kind"] == KINDS.index(kind))
    bins = np.searchsorted(edges, energies[name][ours], side="right") - 1
    where = [species[log["ball"][ours]], bins]
    if kind == "ball_ball":
        where.insert(1, species[log["partner"][ours]])
    expected = np.zeros_like(found)
    np.add.at(expected, tuple(where), 1)
    assert expected.sum() > 100 and np.array_equal(found, expected)


@pytest.mark.parametrize("name", ["normal", "total", "dissipated"])
def test_blocks_of_time_have_the_energies_of_the_log_in_every_fourth_bin(file, log, energies, name):
    blocks = file["statistics/energies/blocks"]
    edges = blocks["edges"][:]
    assert np.array_equal(edges[1:-1], file["statistics/energies/edges"][1::4])
    when = np.floor((log["time"] - BEGIN) / blocks["duration"][()])
    for kind in KINDS:
        found = blocks[f"{kind}/{name}"][:].sum(axis=(1, 2) if kind == "ball_ball" else 1)
        ours = (when >= 0) & (when < len(found)) & (log["kind"] == KINDS.index(kind))
        expected = np.zeros_like(found)
        np.add.at(expected, (when[ours].astype(int), np.searchsorted(edges, energies[name][ours], side="right") - 1), 1)
        assert expected.sum() > 100 and np.array_equal(found, expected)


@pytest.mark.parametrize("kind", KINDS)
def test_energies_of_all_pairs_are_all_impacts_of_the_kind_and_their_loss(file, kind):
    group, impacts = file[f"statistics/energies/{kind}"], file[f"statistics/impacts/{kind}"]
    for name in ("normal", "total", "dissipated"):
        assert group[name][:].sum() == impacts["count"][()]
    loss = impacts["dissipated_power"][()] * (END - BEGIN)
    assert group["dissipation"][:].sum() == pytest.approx(loss, rel=1e-12)


def test_edges_of_energies_are_sixteenths_of_octaves_between_infinities(file):
    edges = file["statistics/energies/edges"][:]
    octave, part = np.divmod(np.arange(1024), 16)
    assert np.array_equal(edges[1:-2], 2.0 ** (octave - 44) * (1 + part / 16) / 1e3)
    assert np.isin([1e-3, 1e-2, 1e-1], edges).all()
    assert edges[-2] == 2**20 / 1e3 and edges[0] == -np.inf and edges[-1] == np.inf


TUMBLING = """\
[run]
time = 2 s
sample_from = 1 s
starts = 1
[balls]
bulk_fill = 25 %
diameter = 12 mm
density = 7800 kg/m^3
[motion.roll]
kind = turn
axis = 1 0 0
speed = 60 rpm
[drum]
radius = 60 mm
length = 40 mm
motion = roll
[contact]
restitution = 0.8
friction = 0.5
[output]
frames = 10 ms
"""


def test_the_map_of_a_drum_that_turns_shows_where_the_charge_is(millsim, write_deck, tmp_path):
    done = millsim("-q", "-o", "run.h5", write_deck(TUMBLING))
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "run.h5") as file:
        group = file["statistics/maps/cross_section"]
        solid = np.nan_to_num(group["solid_fraction"][:])
        y, z = ((edges[1:] + edges[:-1]) / 2 for edges in (group["y_edges"][:], group["z_edges"][:]))
        times = file["particles/trajectory/position/time"][:]
        places = file["particles/trajectory/position/value"][:][times >= 1.0]
        drawn = np.array([(solid.sum(axis=1) @ y), (solid.sum(axis=0) @ z)]) / solid.sum()
        flow = [np.nansum(group[f"velocity_{axis}"][:] * solid) / solid.sum() for axis in "yz"]
    assert drawn == pytest.approx(places[:, :, 1:].mean(axis=(0, 1)), abs=1e-3)
    assert drawn[1] < -0.02  # it lies at the bottom, in the laboratory
    assert np.hypot(*flow) < 0.1  # where it stays
