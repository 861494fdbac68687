"""milltools from Python: what it returns is what the file holds, to the last bit; what is wrong is millsim's own
line."""

import html
import os
import pickle
import re
import signal
import subprocess
import sys
import textwrap
import time
import warnings
import zlib

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SMALL, SMALL_START

import milltools
from milltools.read.kinds import KINDS

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM)}
# everything that can be asked for: a mixture, all impacts, a window, states that do not begin at 0
RICH = SMALL.replace(
    "[balls]\ncount = 20\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n",
    "[balls.steel]\ncount = 30\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "[balls.glass]\ncount = 20\ndiameter = 3 mm\ndensity = 2500 kg/m^3\n",
).replace("time = 50 ms", "time = 250 ms\nsample_from = 40 ms")
RICH += "impacts = all\n"
BY_MILLSIM = (milltools.run, milltools.read_deck)  # which says that it cannot read the deck, with its own status

pytestmark = [
    pytest.mark.usefixtures("the_program"),
    pytest.mark.filterwarnings("ignore:not steady:UserWarning"),
]


@pytest.fixture(scope="module")
def rich(tmp_path_factory):
    """A finished run of the mixture: its path."""
    folder = tmp_path_factory.mktemp("rich")
    (folder / "rich.ini").write_text(RICH)
    subprocess.run([PROGRAM, "-q", "rich.ini"], cwd=folder, check=True, capture_output=True)
    return folder / "rich.h5"


@pytest.fixture
def result(rich):
    with milltools.load(rich) as opened:
        yield opened


@pytest.fixture
def file(rich):
    """The same as h5py reads it."""
    with h5py.File(rich) as opened:
        yield opened


def same(values, stored):
    """The same bits in the same type; NaN is NaN."""
    values, stored = np.asarray(values), np.asarray(stored)
    assert values.dtype == stored.dtype and values.shape == stored.shape
    assert values.tobytes() == stored.tobytes()


def python(code, **options):
    """Runs a script of its own."""
    words = [sys.executable, *options.pop("flags", ()), "-c", textwrap.dedent(code)]
    return subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, **options)


# ---- importing


def test_import_needs_no_package():
    done = python("""
        import sys, milltools
        found = {"numpy", "h5py", "pandas", "xarray", "matplotlib", "scipy"} & set(sys.modules)
        sys.exit(" ".join(found) or 0)
    """)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
def test_opening_a_run_needs_neither_pandas_nor_pictures(rich):
    done = python(f"""
        import sys, milltools
        milltools.load({str(rich)!r}).power
        found = {{"pandas", "xarray", "matplotlib", "scipy"}} & set(sys.modules)
        sys.exit(" ".join(found) or 0)
    """)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_name_it_promises_is_there():
    for name in milltools.__all__:
        assert getattr(milltools, name).__doc__
    assert sorted(dir(milltools)) == sorted([*milltools.__all__, "__version__"])
    assert milltools.__version__ == (ROOT / "VERSION").read_text().strip()
    with pytest.raises(AttributeError, match="no attribute 'simulate'"):
        milltools.simulate


# ---- what a run holds


def test_states_are_those_of_the_file_to_the_last_bit(result, file):
    balls = file["particles/trajectory"]
    for name in ("position", "velocity", "angular_velocity"):
        same(result.frames[name], balls[f"{name}/value"])
        assert result.frames[name].dims == ("time", "ball", "axis")
        assert result.frames[name].units == balls[f"{name}/value"].attrs["unit"]
    same(result.frames.time, balls["position/time"])
    same(result.frames.mass, balls["mass"])
    same(result.frames.diameter, balls["diameter"])
    assert list(result.frames.species.values) == ["steel"] * 30 + ["glass"] * 20


@pytest.mark.parametrize(
    "part",
    [
        {"time": -1},
        {"time": [9, 2, 2], "ball": 3},
        {"time": slice(None, None, -7), "axis": [2, 0]},
        {"ball": slice(10, 3)},
        {"time": 4, "ball": [49, 0], "axis": 1},
    ],
    ids=str,
)
def test_any_part_of_the_states_is_that_of_the_file(result, file, part):
    chosen = result.frames.position.isel(part)
    whole = file["particles/trajectory/position/value"][:]
    for axis, name in ((2, "axis"), (1, "ball"), (0, "time")):
        if name in part:
            whole = whole[(slice(None),) * axis + (part[name],)]
    same(chosen, whole)


@pytest.mark.parametrize(
    "part",
    [{}, {"time": -1}, {"kind": 3}, {"kind": [4, 0]}, {"time": [7, 1], "kind": slice(0, 0)}],
    ids=str,
)
def test_series_by_kind_are_those_of_the_file(result, file, part):
    for name in ("dissipation", "dissipation_normal", "collisions", "fast_collisions"):
        stored = [file[f"observables/{name}/{kind}/value"][:] for kind in KINDS]
        whole = np.stack(stored, axis=1)
        for axis, key in ((1, "kind"), (0, "time")):
            if key in part:
                whole = whole[(slice(None),) * axis + (part[key],)]
        same(result.series[name].isel(part), whole)


def test_series_have_time_and_units(result, file):
    for name in ("kinetic_energy", "rotational_energy", "potential_energy", "rotor_work", "rotor_torque"):  # fmt: skip
        same(result.series[name], file[f"observables/{name}/value"])
        assert result.series[name].units == file[f"observables/{name}/value"].attrs["unit"]
    same(result.series.time, file["observables/rotor_work/time"])
    assert result.series.time.units == "s"
    assert list(result.series.threshold.values) == [0.5, 1.0, 2.0]


def test_maps_are_those_of_the_file_with_the_cells_middles(result, file):
    for view, dims in (("cross_section", ("y", "z")), ("axial", ("x", "r"))):
        stored = file[f"statistics/maps/{view}"]
        given = result.maps[view]
        assert set(given.data_vars) == set(stored)
        for name in stored:
            same(given[name], stored[name])
            if not name.endswith("_edges"):
                assert given[name].dims == dims and given[name].units == stored[name].attrs["unit"]
        for dim in dims:
            edges = stored[f"{dim}_edges"][:]
            assert np.array_equal(given[dim], (edges[:-1] + edges[1:]) / 2)


def test_the_summary_is_that_of_the_file(result, file):
    table = result.summary
    assert list(table.index) == [*KINDS, "all"]
    for kind in table.index:
        stored = file[f"statistics/impacts/{kind}"]
        for column, path in (
            ("count", "count"),
            ("rate", "rate"),
            ("dissipated_power", "dissipated_power"),
            ("mean", "normal_speed/mean"),
            ("median", "normal_speed/median"),
            ("median_above_floor", "normal_speed/median_above_floor"),
        ):
            same(table[column][kind], stored[path][()])
            assert table.attrs["units"][column] == stored[path].attrs["unit"]
        same(table.floor_share[kind], file[f"statistics/floor_share/{kind}"][()])


@pytest.mark.parametrize("group", ["impacts", "strikes"])
@pytest.mark.parametrize("speed", ["normal_speed", "tangential_speed"])
def test_spectra_are_those_of_the_file(result, file, group, speed):
    for kind in (*KINDS, "all"):
        table = result.spectrum(kind, group=group, speed=speed)
        stored = file[f"statistics/{group}/{kind}/{speed}/histogram"]
        same(table.low, stored["edges"][:-1])
        same(table.high, stored["edges"][1:])
        same(table["count"], stored["count"])
        same(table.dissipation, stored["dissipation"])
    duration = file["statistics/duration"][()]
    assert np.array_equal(table.power, table.dissipation / duration)
    assert list(table.attrs["units"]) == list(table.columns)


def test_the_log_of_impacts_is_read_by_slices(result, file):
    log, impacts = file["impacts"], result.impacts
    count = len(log["time"])
    assert len(impacts) == count > 500
    part = impacts[100:200]
    for name in ("time", "ball", "partner", "normal_speed", "tangential_speed", "dissipation"):
        same(part[name], log[name][100:200])
    same(part[["x", "y", "z"]], log["position"][100:200])
    same(part[["normal_x", "normal_y", "normal_z"]], log["normal"][100:200])
    assert list(part.kind) == [KINDS[k] for k in log["kind"][100:200]]
    assert (part.index[0], part.index[-1]) == (100, 199)
    assert list(impacts[-5:].index) == list(range(count - 5, count))
    assert len(impacts[10:5]) == 0
    assert [len(chunk) for chunk in impacts.chunks(count - 3)] == [count - 3, 3]
    with pytest.raises(TypeError, match="without a step"):
        impacts[::2]


def test_numbers_come_with_their_errors_and_units(result, file):
    rotor = file["statistics/rotor"]
    assert result.power.value == rotor["power"][()] == float(result.power)
    assert result.power.error == pytest.approx(rotor["power_error"][()], nan_ok=True)
    assert (result.torque.value, result.torque.unit) == (rotor["torque"][()], "N m")
    assert result.torque.error == pytest.approx(rotor["torque_error"][()], nan_ok=True)
    stored = file["statistics/impacts/all/normal_speed/median_above_floor"][()]
    assert result.median_impact_speed.value == stored
    told = file["statistics/precision/median_above_floor/standard_error"][()]
    assert result.median_impact_speed.error == pytest.approx(told, nan_ok=True)


@pytest.mark.parametrize("kind, species", [("ball_ball", ("steel", "glass")), ("ball_drum", "glass")])
def test_rates_above_an_energy_are_those_of_the_logged_impacts(result, file, kind, species):
    log, least = file["impacts"], 2.0**-9 * 1e-3  # [J] an edge
    mass = np.where(np.arange(50) < 30, 7800 * 0.005**3, 2500 * 0.003**3) * np.pi / 6
    ball, partner = log["ball"][:], log["partner"][:]
    chosen = (log["kind"][:] == KINDS.index(kind)) & (log["time"][:] >= 0.04)
    if kind == "ball_ball":
        chosen &= (ball < 30) != (partner < 30)
        mass = mass[ball] * mass[partner] / (mass[ball] + mass[partner])
    else:
        chosen &= ball >= 30
        mass = mass[ball]
    normal = mass / 2 * log["normal_speed"][:] ** 2
    total = normal + mass / 2 * log["tangential_speed"][:] ** 2
    energies = {"normal": normal, "total": total, "dissipated": log["dissipation"][:]}
    for name, energy in energies.items():
        expected = np.sum(energy[chosen] >= least) / 0.21
        speed = f"{name}_energy"
        assert expected > 0
        assert result.rate(least, kind, speed=speed, species=species) == pytest.approx(expected)
    table = result.spectrum(kind, speed="normal_energy", species=species)
    hard = table["low"] >= least
    assert table["dissipation"][hard].sum() == pytest.approx(log["dissipation"][:][chosen & (normal >= least)].sum())
    assert result.rate(0, kind, speed="normal_energy") == pytest.approx(
        result.rate(0, kind)  # by speed: all of them
    )


def test_all_that_is_known_with_an_error_is_in_one_table(result, file):
    table, told = result.estimates, file["statistics/precision"]
    for name, place, column in (
        ("median", "median", ()),
        ("rate/ball_drum", "rate/ball_drum", ()),
        ("rate_above_1/all", "fast_rate/all", 1),
    ):
        parts = [told[f"{place}/{p}"][column] for p in ("value", "standard_error", "degrees_of_freedom")]  # fmt: skip
        assert list(table.loc[name])[:3] == pytest.approx(parts, nan_ok=True, rel=0)
    assert table.loc["rate_above_1/all", "unit"] == "s-1"


@pytest.mark.filterwarnings("ignore:.*rebound floor")
def test_where_a_run_knows_its_precision_that_is_the_error():
    result = milltools.run(SMALL, run__time="1 s", run__precision=0.1)
    known = "statistics/precision/{}/standard_error"
    median = result.read(known.format("median_above_floor"))
    assert result.median_impact_speed.error == pytest.approx(median, nan_ok=True)
    assert result.power.error == result.read(known.format("rotor_power")) > 0


@pytest.mark.parametrize(
    "value, error, text",
    [
        (862.512, 15.13, "862.5 +- 15.1 W"),
        (862.512, 0.01513, "862.5120 +- 0.0151 W"),
        (862.512, 1513.0, "863 +- 1513 W"),
        (862.512, float("nan"), "862.5 W"),
        (0.0, 0.0, "0 W"),
    ],
)
def test_a_measurement_shows_the_digits_that_count(value, error, text):
    assert str(milltools.Measurement(value, error, "W")) == text


# ---- laziness


def test_a_state_is_read_when_it_is_used_and_no_more(result, monkeypatch):
    read, reader = [], result.file.read

    def spy(path, index=(), why=""):
        found = reader(path, index, why)
        read.append((path, np.size(found)))
        return found

    monkeypatch.setattr(result.file, "read", spy)
    last = result.frames.position.isel(time=-1)
    assert not [path for path, _ in read if path.endswith("/value")]
    last.mean("ball").values
    assert [one for one in read if one[0].endswith("/value")] == [("particles/trajectory/position/value", 50 * 3)]


@pytest.mark.thorough
def test_a_run_of_gigabytes_opens_and_streams_in_little_memory(tmp_path, millsim, small_deck):
    assert millsim("deck.ini", "-q").returncode == 0
    with h5py.File(tmp_path / "deck.h5", "r+") as file:
        balls = file["particles/trajectory"]
        frames, count = 2000, 30_000
        for name in ("position", "velocity", "angular_velocity"):
            del balls[f"{name}/value"]
            shape = {"shape": (frames, count, 3), "dtype": "f4", "chunks": (1, count, 3)}
            value = balls.create_dataset(f"{name}/value", **shape, compression="gzip")
            packed = zlib.compress(bytes(12 * count))  # balls at rest take little room on the disk
            for frame in range(frames):
                value.id.write_direct_chunk((frame, 0, 0), packed)
        balls["position/value"][1] = 2.0
        for name in ("id", "mass", "diameter", "species"):
            stored = np.resize(balls[name][:], count)
            attributes = dict(balls[name].attrs)
            del balls[name]
            balls[name] = stored
            balls[name].attrs.update(attributes)
        balls["id"][:] = np.arange(count)
        del balls["position/time"]
        balls["position/time"] = np.arange(frames) * 1e-3
    done = python(f"""
        import re, milltools
        def most():  # the peak of this program alone [kB]; getrusage knows that of whoever started it, too
            return int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])
        result = milltools.load({str(tmp_path / "deck.h5")!r})
        frames = result.frames
        repr(result), repr(frames)
        used = most()
        assert frames.nbytes > 2e9
        means = frames.position.chunk(time=20).mean(["ball", "axis"]).values
        assert means[1] == 2 and abs(means).sum() == 2
        more = most()
        print(used // 1024, more // 1024)
    """)
    assert done.returncode == 0, done.stderr
    opened, streamed = map(int, done.stdout.split())  # MiB
    assert opened < 300 and streamed < 600


def test_arrays_are_made_once_and_keep_no_values(result, monkeypatch):
    assert result.frames is result.frames and result.series is result.series and result.maps is result.maps
    read, reader = [], result.file.read
    monkeypatch.setattr(result.file, "read", lambda path, *more: read.append(path) or reader(path, *more))
    for _ in range(2):
        result.frames.position.values
    assert read == ["particles/trajectory/position/value"] * 2


def test_a_mill_without_a_rotor_has_no_columns_of_one():
    still = "".join(
        part for part in re.split(r"(?=^\[)", SMALL, flags=re.M) if not part.startswith(("[rotor]", "[blades]"))
    )
    series = milltools.run(still, balls__speed="1 m/s").series
    assert "kinetic_energy" in series and "collisions" in series
    assert not [name for name in series if name.startswith("rotor_") or "motion" in name]


def test_states_go_to_another_process(result):
    again = pickle.loads(pickle.dumps(result.frames))
    same(again.velocity, result.frames.velocity)


# ---- words about it


def test_a_run_shows_its_summary(result):
    text = repr(result)
    for word in (
        "30 steel balls of 5", "20 glass balls of 3", "600 rpm",
        str(result.power), "ball_blade", "dissipated power [W]",
    ):  # fmt: skip
        assert word in text
    page = result._repr_html_()
    assert "<table" in page and str(result.power) in page
    assert page.count("<tr") == 1 + len(KINDS) + 1


def test_what_comes_from_a_file_is_escaped_in_notebooks(rich, tmp_path):
    path = tmp_path / "<script>alert(1)<"
    path.write_bytes(rich.read_bytes())
    with h5py.File(path, "r+") as file:
        del file["run/status"]
        file["run/status"] = "<b>&"
    page = milltools.load(path)._repr_html_()
    assert "<script" not in page and "<b>&" not in page
    assert "&lt;script&gt;alert(1)&lt;" in page and "&lt;b&gt;&amp;" in page


def test_a_run_without_results_says_so(rich, tmp_path):
    path = tmp_path / "early.h5"
    path.write_bytes(rich.read_bytes())
    with h5py.File(path, "r+") as file:
        del file["statistics"], file["run/status"]
        file["run/status"] = "running"
    result = milltools.load(path)
    assert "none: status 'running'" in repr(result) and "none" in result._repr_html_()
    for use in ("power", "summary", "maps", "median_impact_speed"):
        with pytest.raises(milltools.UserError, match="no statistics yet"):
            getattr(result, use)


def test_what_was_not_kept_is_said_with_what_it_takes(small_deck):
    result = milltools.run(small_deck, output__frames="0 s")
    with pytest.raises(milltools.UserError, match="not logged: run it with output.impacts = all"):
        result.impacts
    with pytest.raises(milltools.UserError, match=r"no ball states are stored \(output.frames"):
        result.frames
    with pytest.raises(milltools.UserError, match="unknown 'ball-ball': one of ball_ball, "):
        result.spectrum("ball-ball")


def test_a_closed_run_says_so(rich):
    with milltools.load(rich) as result:
        frames = result.frames
    assert repr(result) == f"<run {rich}, closed>" and result._repr_html_() is None
    for use in (lambda: frames.position.values, lambda: result.power, lambda: result.series):
        with pytest.raises(milltools.UserError, match="was closed"):
            use()


@pytest.mark.parametrize(
    "name, words, kind",
    [("no.h5", "no such file", milltools.MissingFileError), ("rich.ini", "not a readable", milltools.InputError)],
)
def test_what_is_no_run_is_one_line(rich, name, words, kind):
    with pytest.raises(milltools.MillsimError, match=words) as fault:
        milltools.load(rich.parent / name)
    assert type(fault.value) is kind and isinstance(fault.value, ValueError)
    assert isinstance(fault.value, FileNotFoundError) == (name == "no.h5")
    assert fault.value.status == 2 and "\n" not in str(fault.value)


@pytest.mark.parametrize("use", [milltools.run, milltools.read_deck, milltools.load, milltools.load_study])
def test_a_file_that_is_not_there_is_a_file_not_found(tmp_path, use):
    name = "nope.parquet" if use is milltools.load_study else "nope.ini"
    with pytest.raises(FileNotFoundError, match=r"nope\.\w+: .*[Nn]o such file") as fault:
        use(tmp_path / name)
    assert isinstance(fault.value, milltools.MillsimError) and fault.value.status == (1 if use in BY_MILLSIM else 2)


def test_errors_are_told_apart_and_survive_a_journey():
    wrong, outside = milltools.UserError("a  b\nc"), milltools.UserError("disk full", status=1)
    absent = milltools.MissingFileError("x: no such file")
    assert (str(wrong), type(wrong), type(outside)) == ("a b c", milltools.InputError, milltools.MillsimError)
    assert not isinstance(outside, ValueError)
    for fault in (wrong, outside, absent):
        again = pickle.loads(pickle.dumps(fault))
        assert (type(again), str(again), again.status) == (type(fault), str(fault), fault.status)


# ---- the player


@pytest.mark.slow
def test_a_notebook_shows_the_player_in_a_frame_of_its_own(result, monkeypatch):
    monkeypatch.setattr("milltools.api.plots.in_notebook", lambda: True)
    markup = result.show(height=500)._repr_html_()
    assert markup.startswith('<iframe sandbox="allow-scripts" ') and "height: 500px" in markup
    page = html.unescape(re.search(r'srcdoc="([^"]*)"', markup)[1])
    assert page.startswith("<!doctype html>") and 'class="mill-player"' in page


@pytest.mark.slow
def test_elsewhere_the_player_is_a_page_where_it_is_asked_for(result, tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    with pytest.raises(milltools.InputError, match=r"not in a notebook: show\(browser=True\) opens a browser"):
        result.show()
    path = result.show(tmp_path / "balls.html")
    assert path == tmp_path / "balls.html" and "mill-player" in path.read_text() and not opened
    temporary = result.show(browser=True)
    assert opened == [temporary.as_uri()] and temporary.read_text() == path.read_text()


# ---- running


@pytest.mark.slow
def test_a_deck_may_be_a_path_a_text_or_a_dictionary(small_deck, tmp_path):
    dictionary = {
        "run": {"time": "50 ms"},
        "balls": {"count": 20, "diameter": "5 mm", "density": "7800 kg/m^3"},
        "drum": {"radius": "30 mm", "length": "40 mm"},
        "rotor": {"speed": "600 rpm", "shaft_radius": "5 mm"},
        "blades": {"count": np.int64(2), "tip_radius": "22 mm", "width": "6 mm", "thickness": "4 mm"},
        "contact": {"restitution": 0.8, "friction": np.float64(0.3)},
        "output": {"frames": "5 ms"},
    }  # fmt: skip
    results = [milltools.run(deck) for deck in (small_deck, str(small_deck), SMALL, dictionary)]
    states = [result.frames.position.values.tobytes() for result in results]
    assert len(set(states)) == 1
    assert os.listdir(tmp_path) == ["deck.ini"]


def test_overrides_are_keys_of_the_deck(small_deck):
    result = milltools.run(small_deck, rotor__speed="900 rpm", balls__count=7, **{"contact.ball_blade.friction": 0.5})
    deck = result.deck
    assert float(deck["rotor"]["speed"].split()[0]) == pytest.approx(30 * np.pi, rel=1e-15)
    assert (deck["balls"]["count"], deck["contact.ball_blade"]["friction"]) == ("7", "0.5")
    assert milltools.run(deck).frames.position.identical(result.frames.position)


@pytest.mark.parametrize(
    "overrides, line",
    [
        ({"rotor__spede": 3}, "--set rotor.spede=3: [rotor] spede: unknown key; did you mean 'speed'?"),
        ({"rotor__speed": 3},
         "--set rotor.speed=3: [rotor] speed: expected an angular speed with its unit such as '1000 rpm', got '3'"),
        ({"rotor__speed": [3]}, "rotor.speed: expected a text such as '1500 rpm', or a number, got list"),
        ({"rotor__speed": True}, "rotor.speed: expected a text such as '1500 rpm', or a number, got bool"),
        ({"rotor__speed": "3 rpm\n[run]"}, "'3 rpm\\n[run]' (rotor.speed): expected one line of plain text"),
    ],
)  # fmt: skip
def test_a_wrong_key_or_value_is_one_line(small_deck, overrides, line):
    with pytest.raises(milltools.UserError) as fault:
        milltools.run(small_deck, **overrides)
    assert (str(fault.value), fault.value.status) == (line, 2)


def test_a_keyword_that_is_no_key_of_a_deck_is_a_type_error(small_deck):
    with pytest.raises(TypeError, match="'speed': keys of the deck are spelled section__key"):
        milltools.run(small_deck, speed="3 rpm")
    with pytest.raises(TypeError, match="expected a path, a text or a dictionary, got int"):
        milltools.run(3)


@pytest.mark.parametrize(
    "deck, line",
    [
        ({"rotor": {"spede": 3}}, "deck: [rotor] shaft_radius: missing (radius of the shaft; 0 m: none); expected a "
         "length such as '75 mm', or 'shaft_diameter'\n"
         "deck: [rotor] spede: unknown key; did you mean 'speed'?\n"),
        ({"rotor": 3}, "rotor: expected a dictionary of keys, such as {'speed': '1500 rpm'}, got int"),
        ("[run]\ntime = 3\n", "deck:2: [run] time: expected a time with its unit such as '10 ms', got '3'\n"),
        ("nowhere.ini", "nowhere.ini: cannot be read: No such file or directory"),
    ],
    ids=["key", "form", "text", "path"],
)  # fmt: skip
def test_a_wrong_deck_is_millsims_own_lines(deck, line):
    """A line that ends here is followed by those about the keys that are missing."""
    with pytest.raises(milltools.UserError) as fault:
        milltools.run(deck)
    assert str(fault.value) == line or (line.endswith("\n") and str(fault.value).startswith(line))


def test_all_faults_of_a_wrong_deck_are_lines_of_the_error(small_deck):
    wrong = {"balls.size": "3 mm", "drum.inner_diameter": "3 mm"}
    with pytest.raises(milltools.InputError) as fault:
        milltools.run(small_deck, **wrong)
    assert fault.value.lines == [
        "--set balls.size=3 mm: [balls] size: unknown key; here it is balls.diameter",
        "--set drum.inner_diameter=3 mm: [drum] inner_diameter: unknown key; here it is drum.diameter",
    ]
    again = pickle.loads(pickle.dumps(fault.value))
    assert (again.lines, again.status) == (fault.value.lines, 2)
    assert again.line == f"{again.lines[0]} (and 1 more fault)"


def test_a_value_cannot_smuggle_in_another_key():
    for deck in ({"run": {"time": "1 s\n[x]"}}, {"run": {"a\nb": 1}}, {"a]\n[b": {}}):
        with pytest.raises(milltools.UserError, match="one line of plain text"):
            milltools.run(deck)


def test_a_start_file_counts_from_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "my # start.txt").write_text(SMALL_START)
    monkeypatch.chdir(tmp_path)
    first = [float(x) for x in SMALL_START.split()[:3]]
    text = SMALL.replace("count = 20", 'count = 20\nstart = "my # start.txt"')
    for given, more in ((text, {}), (SMALL, {"balls__start": "my # start.txt"})):
        result = milltools.run(given, **more)
        assert result.frames.position[0, 0].values == pytest.approx(first, abs=1e-9)
        deck = result.deck
    assert milltools.run(deck).frames.position[0, 0].values == pytest.approx(first, abs=1e-9)


def test_an_output_that_exists_is_kept_unless_forced(small_deck, tmp_path):
    kept = milltools.run(small_deck, tmp_path / "a.h5")
    before = kept.path.read_bytes()
    with pytest.raises(milltools.UserError, match="a.h5: exists already; force=True overwrites"):
        milltools.run(small_deck, kept.path, run__seed=2)
    assert kept.path.read_bytes() == before
    other = milltools.run(small_deck, kept.path, force=True, run__seed=2)
    assert other.deck["run"]["seed"] == "2" and kept.deck["run"]["seed"] == "1"


def test_resuming_what_is_complete_gives_it(small_deck, tmp_path):
    first = milltools.run(small_deck, tmp_path / "a.h5", resume=True)
    again = milltools.run(small_deck, tmp_path / "a.h5", resume=True)
    assert again.read("run/started") == first.read("run/started")
    with pytest.raises(milltools.UserError, match="is of another deck"):
        milltools.run(small_deck, tmp_path / "a.h5", resume=True, balls__count=10)


def test_a_temporary_output_goes_with_its_result(small_deck):
    result = milltools.run(small_deck)
    assert result.path.exists() and result.name == "deck (temporary)"
    folder = result.path.parent
    result.close()
    assert not folder.exists()
    folder = milltools.run(small_deck).path.parent  # nobody holds it
    assert not folder.exists()


def test_what_millsim_remarks_is_a_warning(small_deck):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        milltools.run(small_deck, blades__tip_radius="27 mm")
    texts = [str(one.message) for one in told]
    assert any("balls can be pinched" in text for text in texts)
    assert any(text.startswith("not steady: ") for text in texts)
    assert {one.filename for one in told} == {__file__}


def test_without_a_millsim_it_says_what_to_do(tmp_path):
    package = tmp_path / "site-packages"
    package.mkdir()
    (package / "milltools").symlink_to(ROOT / "tools/milltools")
    done = python(
        f"""
        import sys; sys.path.insert(0, {str(package)!r})
        import pathlib, milltools
        from milltools.base import engine
        engine.ROOT, engine.IN_CHECKOUT = pathlib.Path({str(tmp_path)!r}), False
        import os; del os.environ["MILLSIM"]; os.environ["PATH"] = "/nowhere"
        try: milltools.run("a.ini")
        except milltools.UserError as fault: print(fault, fault.status)
        """
    )
    assert done.stdout == (
        "no millsim found: install its wheel ('pip install ./millsim-*.whl'); or build it ('make millsim' in its "
        "checkout), then put it on the PATH ('make install') or set the environment variable MILLSIM to the path of "
        "the program 1\n"
    )


LONG = """
    import milltools
    try:
        milltools.run({deck!r}, {output}, run__time="1000 s", progress={progress})
    except KeyboardInterrupt as fault:
        print("interrupted", *getattr(fault, "__notes__", []), flush=True)
"""


def interrupted(deck, output, progress, after):
    """Starts a run of hours in a Python of its own, interrupts that after a while [s]; its output, errors and how many
    processes of its session are left."""
    code = textwrap.dedent(LONG).format(deck=str(deck), output=output, progress=progress)
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        env=ENVIRONMENT,
        cwd=deck.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    until = time.monotonic() + 30
    while not children(process.pid) and time.monotonic() < until:
        time.sleep(0.02)
    found = children(process.pid)
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    said, errors = (stream.decode() for stream in process.communicate(timeout=60))
    return said, errors, [pid for pid in found if os.path.exists(f"/proc/{pid}")]


def children(pid):
    with open(f"/proc/{pid}/task/{pid}/children") as file:
        return file.read().split()


@pytest.mark.slow
def test_an_interrupt_ends_it_and_what_is_done_can_be_resumed(small_deck, tmp_path):
    said, errors, left = interrupted(small_deck, "'a.h5'", False, after=0.7)
    assert (said, errors, left) == (
        "interrupted a.h5 contains everything up to then; resume=True continues\n", "", []
    )  # fmt: skip
    with milltools.load(tmp_path / "a.h5") as result:
        assert result.status == "stopped" and result.time > 0
    assert sorted(os.listdir(tmp_path)) == ["a.h5", "deck.ini"]


@pytest.mark.slow
def test_progress_is_shown_of_long_runs(small_deck, tmp_path, monkeypatch):
    monkeypatch.setitem(ENVIRONMENT, "TMPDIR", str(tmp_path))
    said, errors, left = interrupted(small_deck, None, True, after=3.5)
    assert (said, left) == ("interrupted\n", [])
    assert re.fullmatch(r"millsim: \S+ s of 1000 s, \S+ contacts/s, \d+ %, .* left\n", errors)
    assert os.listdir(tmp_path) == ["deck.ini"]  # nothing temporary is left


@pytest.mark.filterwarnings("ignore:.*rebound floor")
@pytest.mark.slow
def test_a_notebook_has_progress_in_one_line_that_goes_again(small_deck, capsys, monkeypatch):
    monkeypatch.setattr("milltools.base.progress.in_notebook", lambda: True)
    monkeypatch.setattr("milltools.base.progress.PATIENCE", 0.0)
    milltools.run(small_deck, run__time="60 s", output__frames="0 s", progress=True)
    told = capsys.readouterr()
    first, *lines, wiped, end = told.out.split("\r")
    assert (first, told.err, wiped.strip(), end) == ("", "", "", "")
    assert any(re.match(r"millsim: \S+ s of 60 s, \S+ contacts/s, \d+ %, .* left", line) for line in lines)


@pytest.mark.slow
def test_short_runs_show_nothing(small_deck):
    done = python(f"import milltools; milltools.run({str(small_deck)!r}, progress=True)", flags=["-W", "ignore"])
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


# ---- decks


def test_a_deck_written_is_the_deck_read(small_deck, tmp_path):
    deck = milltools.read_deck(small_deck, rotor__speed="900 rpm")
    assert deck["gravity"]["acceleration"] == "0 0 -9.81 m/s^2"  # defaults are filled in
    milltools.write_deck(deck, tmp_path / "mine.ini")
    assert milltools.read_deck(tmp_path / "mine.ini") == deck
    with pytest.raises(milltools.UserError, match="mine.ini: exists already; force=True"):
        milltools.write_deck({}, tmp_path / "mine.ini")
    milltools.write_deck({"run": {"time": "1 s"}}, tmp_path / "mine.ini", force=True)
    assert (tmp_path / "mine.ini").read_text() == "[run]\ntime = 1 s\n"
    assert sorted(os.listdir(tmp_path)) == ["deck.ini", "mine.ini"]


def test_a_deck_that_cannot_be_written_is_an_outside_fault(tmp_path):
    with pytest.raises(milltools.UserError, match="No such file or directory") as fault:
        milltools.write_deck({}, tmp_path / "nowhere/mine.ini")
    assert fault.value.status == 1


def test_the_deck_of_a_run_is_a_plain_dictionary_in_the_order_of_its_text(result):
    deck = result.deck
    assert type(deck) is dict and all(type(keys) is dict for keys in deck.values())
    assert [name for name in deck if name.startswith("balls.")] == ["balls.steel", "balls.glass"]
    deck["rotor"]["speed"] = "10 rpm"
    assert result.deck["rotor"]["speed"] != "10 rpm"
