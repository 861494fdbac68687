"""--export-start: the balls as they start, as a file that balls.start reads back to the same bits."""

import os
import re
import resource

import pytest
from conftest import SMALL, SMALL_START
from results import OWN, differences

# The start is told otherwise, but the balls are the same
TOLD = (*OWN, "/deck/balls/start", "/deck/balls/speed", "/deck/text")

MIXTURE = SMALL.replace(
    "[balls]\ncount = 20\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n",
    "[balls.steel]\ncount = 60\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "[balls.glass]\ncount = 90\ndiameter = 3 mm\ndensity = 2500 kg/m^3\n"
    "[balls.large]\ncount = 10\ndiameter = 6 mm\ndensity = 7800 kg/m^3\n",
)
# So many that they are dropped in smaller and pushed apart
DENSE = SMALL.replace("count = 20", "count = 700").replace("50 ms", "5 ms")
GAS = """\
[run]
time = 20 ms
seed = 4
[balls]
count = 300
diameter = 4 mm
density = 7800 kg/m^3
speed = 2 m/s
[drum]
radius = 40 mm
length = 60 mm
[contact]
restitution = 1
[gravity]
acceleration = 0 0 0 m/s^2
"""
MILLS = {"small": SMALL, "mixture": MIXTURE, "dense": DENSE, "gas": GAS}


def export(millsim, *arguments):
    result = millsim("-q", "--export-start", "start.txt", "deck.ini", *arguments)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def rows(path):
    """The numbers of each row, without the comment."""
    lines = path.read_text().splitlines()
    assert lines[0].startswith("#") and not any("#" in line for line in lines[1:])
    return [[float(word) for word in line.split()] for line in lines[1:]]


@pytest.mark.slow
@pytest.mark.parametrize("mill", ["mixture", "dense", "gas", pytest.param("small", marks=pytest.mark.thorough)])
def test_a_run_from_the_exported_start_stores_the_same_bits(millsim, write_deck, tmp_path, mill):
    write_deck(MILLS[mill])
    export(millsim)
    from_file = ["-s", "balls.start=start.txt", "-s", "balls.speed=0 m/s"]
    assert millsim("-q", "deck.ini", "-o", "random.h5").returncode == 0
    assert millsim("-q", "deck.ini", "-o", "file.h5", *from_file).returncode == 0
    assert differences(tmp_path / "random.h5", tmp_path / "file.h5", TOLD) == []


def test_the_start_of_a_start_file_is_exported_with_its_spins(millsim, write_deck, tmp_path):
    spinning = [f"{row} 0.1 -0.2 0.3 {k} 1e-300 -0" for k, row in enumerate(SMALL_START.split("\n"))]
    (tmp_path / "spinning.txt").write_text("\n".join(spinning[:20]))
    write_deck()
    export(millsim, "-s", "balls.start=spinning.txt")
    assert [list(map(str, row)) for row in rows(tmp_path / "start.txt")] == [
        [str(float(word)) for word in row.split()] for row in spinning[:20]
    ]


def test_one_comment_names_columns_units_and_deck(millsim, write_deck, tmp_path):
    write_deck()
    export(millsim)
    first = (tmp_path / "start.txt").read_text().splitlines()[0]
    assert first == "# x y z [m] vx vy vz [m/s], one ball a line: start of deck.ini"
    assert {len(row) for row in rows(tmp_path / "start.txt")} == {6}
    assert len(rows(tmp_path / "start.txt")) == 20


def test_balls_of_a_mixture_come_in_the_order_of_its_sections(millsim, write_deck, tmp_path):
    """Small balls alone come closer to the drum than large ones can."""
    write_deck(MIXTURE)
    export(millsim)
    reach = [(y * y + z * z) ** 0.5 for _, y, z, *_ in rows(tmp_path / "start.txt")]
    assert len(reach) == 160
    assert max(reach[:60]) <= 0.0275 < max(reach[60:150]) <= 0.0285
    assert max(reach[150:]) <= 0.027


def test_a_deck_with_a_newline_in_its_name_cannot_break_the_comment(millsim, write_deck, tmp_path):
    write_deck(name="a\nb.ini")
    result = millsim("-q", "--export-start", "start.txt", "a\nb.ini")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "start.txt").read_text().splitlines()[0].endswith("start of a?b.ini")
    assert len(rows(tmp_path / "start.txt")) == 20


def test_nothing_else_is_written(millsim, write_deck, tmp_path):
    write_deck()
    export(millsim)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck.ini", "start.txt"]


# ---- refused ----


@pytest.mark.parametrize("other", [["--resume"], ["--check"], ["--output", "a.h5"], ["--json"], ["--paranoid"]])
def test_options_of_a_run_are_refused(millsim, write_deck, tmp_path, other):
    write_deck()
    result = millsim("--export-start", "start.txt", *other, "deck.ini")
    assert result.returncode == 2
    assert result.stderr == (
        f"millsim: options '--export-start' and '{other[0]}' exclude each other: --export-start "
        "only writes the start and runs nothing\n"
    )
    assert not (tmp_path / "start.txt").exists()


@pytest.mark.parametrize(
    "name, complaint",
    [
        ("", "option '--export-start' needs the name of a file"),
        ("none/start.txt", "none/start.txt: cannot be written: its folder: No such file or directory"),
        ("none/", "none/: is not the name of a file"),
        (".", ".: is a folder; give the name of a file"),
        ("deck.ini", "deck.ini: is the deck itself; give it another name"),
        ("own.txt", "own.txt: is the deck's start file; give it another name"),
        ("/dev/null", "/dev/null: is not a regular file; give it another name"),
    ],
)
def test_an_impossible_file_is_refused(millsim, write_deck, tmp_path, name, complaint):
    write_deck()
    (tmp_path / "own.txt").write_text(SMALL_START)
    result = millsim("-f", "--export-start", name, "-s", "balls.start=own.txt", "deck.ini")
    assert (result.returncode, result.stderr) == (2, f"millsim: {complaint}\n")
    assert (tmp_path / "own.txt").read_text() == SMALL_START


def test_an_existing_file_is_kept_unless_forced(millsim, write_deck, tmp_path):
    write_deck()
    (tmp_path / "start.txt").write_text("precious")
    result = millsim("--export-start", "start.txt", "deck.ini")
    complaint = "start.txt: exists already; --force overwrites it"
    assert (result.returncode, result.stderr) == (2, f"millsim: {complaint}\n")
    assert (tmp_path / "start.txt").read_text() == "precious"
    export(millsim, "--force")
    assert len(rows(tmp_path / "start.txt")) == 20


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused(millsim, write_deck, tmp_path):
    write_deck()
    (tmp_path / "locked").mkdir(mode=0o500)
    result = millsim("--export-start", "locked/start.txt", "deck.ini")
    assert result.returncode == 2
    assert "cannot be written: its folder: Permission denied" in result.stderr


def test_a_full_disk_leaves_what_was_there(millsim, write_deck, tmp_path):
    write_deck(GAS)
    (tmp_path / "start.txt").write_text("precious")

    def little_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))

    result = millsim("-qf", "--export-start", "start.txt", "deck.ini", preexec_fn=little_room)
    assert result.returncode == 1
    assert re.fullmatch(r"millsim: start\.txt: cannot write: [^\n]+\n", result.stderr)
    assert (tmp_path / "start.txt").read_text() == "precious"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck.ini", "start.txt"]


def test_balls_that_do_not_fit_are_told_and_nothing_is_written(millsim, write_deck, tmp_path):
    write_deck(SMALL.replace("count = 20", "count = 1150"))
    result = millsim("-q", "--export-start", "start.txt", "deck.ini")
    assert result.returncode == 2
    assert re.fullmatch(r"millsim: deck\.ini:4: \[balls\] count: 1150 balls do not fit \(.*\n", result.stderr)
    assert [p.name for p in tmp_path.iterdir()] == ["deck.ini"]
