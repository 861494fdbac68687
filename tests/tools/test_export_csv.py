"""mill export writes tables as CSV: pandas reads the numbers that h5py reads, to the last bit."""

# ruff: noqa: F811 - the fixtures of export_run
import csv
import io
import math
import shutil

import h5py
import numpy as np
import pytest
from export_run import BALLS, FRAMES, export, make, names, run_file, stored  # noqa: F401

from milltools.dose import dose, wear
from milltools.read.runfile import Run

pd = pytest.importorskip("pandas")

TRAJECTORY = "particles/trajectory"
AXES = ("x", "y", "z")


def read(path, **types):
    """The table as docs/export.md says it is read; columns of single precision are named."""
    exact = {"float_precision": "round_trip"} if pd.__version__ < "3" else {}  # later ones are exact without
    return pd.read_csv(path, dtype=types, **exact)


def bits(column, stored):
    """A column is the stored one: the same bytes once it has the stored type."""
    stored = np.asarray(stored)
    column = np.asarray(column)
    assert np.array_equal(
        column.astype(stored.dtype), column, equal_nan=column.dtype.kind == "f"
    )  # nothing is lost on the way
    return column.astype(stored.dtype).tobytes() == stored.tobytes()


def heads(letter, unit):
    return [f"{letter}{axis} [{unit}]" for axis in AXES]


# ---- balls


def test_pandas_reads_the_balls_to_the_last_bit(export, run_file, stored, tmp_path):
    status, out, err = export(run_file, "balls.csv")
    assert (status, err) == (0, "")
    assert out.startswith("balls.csv: 253 rows (11 frames of 23 balls), ")
    columns = {"position": heads("", "m"), "velocity": heads("v", "m/s")}
    columns["angular_velocity"] = heads("w", "rad/s")
    singles = dict.fromkeys(sum(columns.values(), []), "float32")
    table = read(tmp_path / "balls.csv", **singles)
    assert len(table) == FRAMES * BALLS
    group = stored[TRAJECTORY]
    for name, own in columns.items():
        found = table[own].to_numpy().reshape(FRAMES, BALLS, 3)
        assert found.dtype == "float32"
        assert found.tobytes() == group[f"{name}/value"][:].tobytes(), name
    assert bits(table["time [s]"], np.repeat(group["position/time"][:], BALLS))
    assert list(table["frame"]) == list(np.repeat(np.arange(FRAMES), BALLS))
    assert list(table["id"]) == list(range(BALLS)) * FRAMES
    assert list(table["species"]) == (["steel"] * 16 + ["glass"] * 7) * FRAMES
    for name, head in (("diameter", "diameter [m]"), ("mass", "mass [kg]")):
        assert bits(table[head], np.tile(group[name][:], FRAMES))


def test_numbers_have_no_more_digits_than_it_takes(export, run_file, tmp_path):
    assert export(run_file, "balls.csv", "--frame", -1)[0] == 0
    with open(tmp_path / "balls.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for word in (row["x [m]"] for row in rows):
        value = np.float32(word)
        assert len(word) <= len(repr(float(value)))
        digits = len(word.split("e")[0].lstrip("-0.").replace(".", ""))
        assert digits <= 9
        if digits > 1:  # one digit fewer is another number
            assert np.float32(f"{value:.{digits - 2}e}") != value


def test_chosen_frames_only(export, run_file, tmp_path):
    assert export(run_file, "balls.csv", "--from", "10 ms", "--every", 4)[0] == 0
    assert sorted(set(read(tmp_path / "balls.csv")["frame"])) == [2, 6, 10]


@pytest.mark.parametrize("name", ["=1+1", "+cmd", "-2", "@SUM(A1)"])
def test_a_spreadsheet_takes_no_name_of_a_file_for_a_formula(export, run_file, tmp_path, name):
    foreign = shutil.copy(run_file, tmp_path / "foreign.h5")
    with h5py.File(foreign, "r+") as file:
        species = file[f"{TRAJECTORY}/species"]
        species.attrs["names"] = [name.encode(), b"glass"]
    assert export(foreign, "balls.csv", "--frame", 0)[0] == 0
    assert set(read(tmp_path / "balls.csv")["species"]) == {f"'{name}", "glass"}


# ---- impacts


def test_pandas_reads_the_impact_log_to_the_last_bit(export, run_file, stored, tmp_path):
    status, out, _ = export(run_file, "log.csv", "--what", "impacts")
    log = stored["impacts"]
    rows = len(log["time"])
    assert status == 0 and rows > 50
    assert out.startswith(f"log.csv: {rows} rows, ")
    table = read(tmp_path / "log.csv")
    assert bits(table["time [s]"], log["time"][:])
    assert list(table["kind"]) == [log.attrs["kinds"][k] for k in log["kind"][:]]
    for name, head in (
        ("ball", "ball"),
        ("partner", "partner"),
        ("normal_speed", "normal speed [m/s]"),
        ("tangential_speed", "tangential speed [m/s]"),
        ("dissipation", "dissipated energy [J]"),
    ):
        assert bits(table[head], log[name][:]), name
    singles = {head: "float32" for head in [*heads("", "m"), "nx", "ny", "nz"]}
    table = read(tmp_path / "log.csv", **singles)
    assert table[heads("", "m")].to_numpy().tobytes() == log["position"][:].tobytes()
    assert table[["nx", "ny", "nz"]].to_numpy().tobytes() == log["normal"][:].tobytes()


def test_impacts_of_a_while(export, run_file, stored, tmp_path, monkeypatch):
    from milltools.export import tables as module

    monkeypatch.setattr(module, "BLOCK", 7)  # many blocks
    time = stored["impacts/time"][:]
    low, high = time[[20, 60]]
    words = ("--from", repr(float(low)), "--to", f"{float(high)!r} s")
    assert export(run_file, "log.csv", "--what", "impacts", *words)[0] == 0
    found = read(tmp_path / "log.csv")["time [s]"]
    assert bits(found, time[(time >= low) & (time <= high)])


def test_a_while_without_impacts_has_a_head_and_no_rows(export, run_file, tmp_path):
    assert export(run_file, "log.csv", "--what", "impacts", "--from", "1 s")[:2] == (
        0,
        f"log.csv: 0 rows, {(tmp_path / 'log.csv').stat().st_size} bytes\n",
    )
    assert read(tmp_path / "log.csv").columns[0] == "time [s]"


def test_a_run_that_logged_no_impacts_is_told(export, tmp_path):
    make(tmp_path, "plain.h5", "-s", "output.impacts=statistics", "-s", "run.time=1 ms")
    line = "plain.h5: has no /impacts/time: single impacts are kept with output.impacts = all"
    assert export("plain.h5", "a.csv", "--what", "impacts") == (2, "", f"mill export: {line}\n")
    assert "a.csv" not in names(tmp_path)


# ---- series


def test_pandas_reads_every_series_to_the_last_bit(export, run_file, stored, tmp_path):
    assert export(run_file, "series.csv", "--what", "series")[0] == 0
    table = read(tmp_path / "series.csv")
    series = stored["observables"]
    assert bits(table["time [s]"], series["rotor_work/time"][:])
    power = np.diff(series["rotor_work/value"][:]) / np.diff(series["rotor_work/time"][:])
    assert bits(table["rotor power [W]"], [np.nan, *power])
    left = set(table.columns) - {"time [s]", "rotor power [W]"}
    for head, name in (
        ("kinetic energy [J]", "kinetic_energy"),
        ("rotor torque [N m]", "rotor_torque"),
        ("rotor work [J]", "rotor_work"),
        ("contacts, ball-drum", "collisions/ball_drum"),
        ("dissipated energy, normal part, ball-blade [J]", "dissipation_normal/ball_blade"),
    ):
        assert bits(table[head], series[name]["value"][:]), name
        left.remove(head)
    fast = [f"contacts from {mark} m/s, ball-blade" for mark in ("0.5", "1", "2")]
    assert bits(table[fast], series["fast_collisions/ball_blade/value"][:])
    assert len(left) == 3 + 1 + 4 + 5 + 4 + 15 - 1  # the rest of all there are


def test_series_of_a_while(export, run_file, tmp_path):
    words = ("--what", "series", "--from", "10 ms", "--to", "13 ms")
    assert export(run_file, "series.csv", *words)[0] == 0
    assert list(read(tmp_path / "series.csv")["time [s]"].round(9)) == [0.01, 0.011, 0.012, 0.013]


# ---- spectra


def test_spectra_have_every_bin_of_every_kind(export, run_file, stored, tmp_path):
    assert export(run_file, "spectra.csv", "--what", "spectra")[0] == 0
    table = read(tmp_path / "spectra.csv")
    seconds = stored["statistics/duration"][()]
    kinds = set(table["kind"])
    assert kinds == {"ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade"}
    for (group, kind, speed), rows in table.groupby(["group", "kind", "speed"]):
        found = stored[f"statistics/{group}/{kind}/{speed}_speed/histogram"]
        assert bits(rows["from [m/s]"][1:], found["edges"][:])
        assert bits(rows["to [m/s]"][:-1], found["edges"][:])
        assert bits(rows["count"][1:-1], found["count"][:])
        assert bits(rows["dissipated energy [J]"][1:-1], found["dissipation"][:])
        for side, row in (("underflow", rows.iloc[0]), ("overflow", rows.iloc[-1])):
            assert row["count"] == found["count"].attrs[side]
            assert row["dissipated energy [J]"] == found["dissipation"].attrs[side]
        total = stored[f"statistics/{group}/{kind}/count"][()]
        assert rows["count"].sum() == total
        assert rows["rate [1/s]"].sum() == pytest.approx(total / seconds)
    assert len(table.groupby(["group", "kind", "speed"])) == 2 * 5 * 2


def test_a_run_without_statistics_has_no_spectra(export, run_file, tmp_path):
    shutil.copy(run_file, tmp_path / "early.h5")
    with h5py.File(tmp_path / "early.h5", "r+") as file:
        del file["statistics"]
    status, _, err = export("early.h5", "a.csv", "--what", "spectra")
    assert status == 2 and err.startswith("mill export: early.h5: no statistics yet")


# ---- the summary


def test_the_summary_has_a_row_a_kind_and_the_power_in_the_last_row(export, run_file, stored, tmp_path):
    assert export(run_file, "summary.csv", "--what", "summary")[0] == 0
    table = read(tmp_path / "summary.csv").set_index("kind")
    assert list(table.index) == ["ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade", "all"]
    statistics = stored["statistics"]
    for head, path in (
        ("impacts", "count"),
        ("impacts [1/s]", "rate"),
        ("dissipated power [W]", "dissipated_power"),
        ("median impact speed [m/s]", "normal_speed/median"),
        ("median impact speed above the floor [m/s]", "normal_speed/median_above_floor"),
    ):
        assert bits(table[head], [statistics[f"impacts/{kind}/{path}"][()] for kind in table.index]), head
    assert table["power [W]"]["all"] == statistics["rotor/power"][()]
    assert table["power [W]"].notna().sum() == 1


# ---- workbooks


def test_doses_and_wear_are_the_numbers_of_their_commands(export, run_file, tmp_path):
    powder, hard = ["powder.mass=2 g", "powder.density=4 g/cm^3"], ["wear.archard=1e-4", "wear.hardness=2 GPa"]
    for what, (one, other) in (("dose", powder), ("wear", hard)):
        assert export(run_file, f"{what}.csv", "--what", what, "-s", one, "-s", other)[0] == 0
    dosed, worn = (read(tmp_path / name) for name in ("dose.csv", "wear.csv"))
    with Run(run_file) as run:
        rows, faces = dose.rows(run, powder), wear.faces(run, hard)
    assert dosed["value"].tolist() == [row.value for row in rows] and "dose rate" in dosed["result"].tolist()
    assert worn["depth [m/s]"].tolist() == pytest.approx([face.depth for face in faces], nan_ok=True)
    assert worn["power lost by sliding [W]"].tolist() == [face.sliding for face in faces]


def sheets(path):
    """{name: rows of values} of a workbook."""
    openpyxl = pytest.importorskip("openpyxl")
    return {sheet.title: list(sheet.values) for sheet in openpyxl.load_workbook(path)}


@pytest.mark.slow
def test_a_workbook_has_summary_series_and_spectra_on_sheets(export, run_file, tmp_path):
    assert export(run_file, "mill.xlsx")[0] == 0
    found = sheets(tmp_path / "mill.xlsx")
    assert list(found) == ["summary", "dose", "wear", "series", "spectra"]
    for what, rows in found.items():
        assert export(run_file, "one.csv", "--what", what)[0] == 0
        table = read(tmp_path / "one.csv", kind=str).replace([np.inf], np.nan)
        assert list(rows[0]) == list(table.columns)
        assert len(rows) == 1 + len(table)
        for cells, line in zip(rows[1:], table.itertuples(index=False)):
            for one, other in zip(cells, line):
                if isinstance(other, str):
                    assert one == other
                else:  # a workbook has 16 digits
                    assert (one is None and np.isnan(other)) or math.isclose(one, other, rel_tol=1e-15)


def test_single_precision_comes_back_from_a_workbook(export, run_file, stored, tmp_path):
    assert export(run_file, "balls.xlsx", "--what", "balls", "--frame", 1)[0] == 0
    head, *rows = sheets(tmp_path / "balls.xlsx")["balls"]
    place = head.index("x [m]")
    found = np.array([row[place : place + 3] for row in rows])
    assert found.astype("f4").tobytes() == stored[f"{TRAJECTORY}/position/value"][1].tobytes()
    assert max(len(repr(float(value))) for value in found[:, 0]) <= len("-0.0123456789e-05")


def test_a_table_longer_than_a_sheet_is_one_line_and_nothing_is_written(export, run_file, tmp_path, monkeypatch):
    from milltools.export import xlsx

    monkeypatch.setattr(xlsx, "ROWS", 252)
    line = (
        "mill export: a.xlsx: a sheet of Excel has room for 252 rows, and balls has 253: write .csv, or choose fewer "
        "rows with --from, --to, --every, --frame\n"
    )
    assert export(run_file, "a.xlsx", "--what", "balls") == (2, "", line)
    assert names(tmp_path) == []


# ---- tables


@pytest.mark.parametrize(
    "words, line",
    [
        (["a.gsd", "--what", "series"], "a .gsd file cannot contain series: write .csv or .xlsx"),
        (["a.csv", "--what", "mill"], "a .csv file cannot contain mill: write .stl or .vtp or .pvd"),
        (["a.xlsx", "--to", "1 s"], "--to: only for one table: add --what series"),
        (["a.csv", "--what", "series", "--frame", "1"], "--frame: only for frames, not for series"),
        (["a.csv", "--what", "spectra", "--to", "1 s"], "--to: spectra: always of the whole sampled window"),
    ],
)  # fmt: skip
def test_what_a_table_cannot_be_is_one_line(export, run_file, tmp_path, words, line):
    assert export(run_file, *words) == (2, "", f"mill export: {line}\n")
    assert names(tmp_path) == []


def test_texts_and_numbers_out_of_the_ordinary_come_back():
    from milltools.export.csv import fill

    texts = ["a,b", 'say "c"', "two\nlines", "", "ä"]
    numbers = np.array([0.1, -0.0, np.nan, np.inf, 1e-310])
    singles = np.array([0.1, 1e-45, 3.4028235e38, -0.0, 16777216], "f4")
    file = io.BytesIO()
    assert fill(file, 2 * [{"name, of": np.array(texts, object), "x [m]": numbers, "y [m]": singles}]) == 2 * len(texts)
    file.seek(0)
    table = pd.read_csv(file, dtype={"y [m]": "float32"}, keep_default_na=False, na_values={"x [m]": [""]})
    assert list(table["name, of"]) == texts * 2
    assert table["x [m]"].to_numpy().tobytes() == np.tile(numbers, 2).tobytes()
    assert table["y [m]"].to_numpy().tobytes() == np.tile(singles, 2).tobytes()
