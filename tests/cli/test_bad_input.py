"""Start files and decks as wrong as they come: one line that names the file, status 2, nothing written.

Wrong values, keys and sections of decks are in test_deck.py, wrong usage in test_command.py.
"""

import os
import socket
import subprocess
import time

import numpy as np
import pytest
from conftest import PROGRAM, SMALL, SMALL_START

from milltools.geometry import contour
from milltools.read.deck import Deck

ROWS = SMALL_START.splitlines()
FORM = "expected 3, 6 or 9 numbers 'x y z [vx vy vz [wx wy wz]]' in SI units"
MILL = SMALL.replace("density = 7800 kg/m^3\n", "density = 7800 kg/m^3\nstart = start.txt\n")
HEADER = "; is this a header? put a '#' in front of it"
SEMICOLON = "; it has ';' between them: write blanks, and decimal points"
COMMA = "; write decimal points, and commas between all numbers or between none"
LIGHT = "a speed above that of light: give m/s and rad/s"


@pytest.fixture
def with_start(write_deck, tmp_path):
    """with_start(content) writes the small mill's deck and its start file, text or bytes."""

    def write(content):
        write_deck(MILL)
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / "start.txt").write_bytes(data)

    return write


def test_the_plain_start_file_runs(millsim, with_start):
    with_start(SMALL_START)
    assert millsim("deck.ini", "-q").returncode == 0


# ---- one wrong row, in the place of row 3 ----

WRONG_ROWS = [
    ("0 0.027", FORM),
    ("0 0.027 0 1", FORM),
    ("0 0.027 0 1 2 3 4", FORM),
    ("0 0.027 0 1 2 3 4 5 6 7", FORM),
    ("0 " * 5000, FORM),
    ("1" * 100_000, FORM),
    ("x y z", FORM),
    ("0 0.027 0 m", FORM),
    ("0 27mm 0", FORM),
    ("0;0.027;0", FORM + SEMICOLON),
    ("0,0;0,027;0,0", FORM + SEMICOLON),
    ("0 0.027 0 1-2 3", FORM),  # would be six numbers
    ("0 0.02.7 0", FORM),
    ("0 +-0.027 0", FORM),
    ("0 0.027 1e", FORM),
    ("0 0.027 nan", FORM),
    ("0 0.027 0 0 0 0 0 0 NaN", FORM),
    ("0 1e400 0", FORM),
    ("0 0x1.ba5e353f7ced9p-6 0", FORM),
    ("0 0.027 0X0", FORM),
    ("0,0 0,027 0,0", FORM + COMMA),  # would be six numbers, the ball at the axis
    ("0,,0.027,0", FORM + COMMA),
    ("0 0.027 0\0 0 0 0", FORM),
    ("0 0.027 \u0660", FORM),
    ("0\u00a00.027 0", FORM),
    ("0 0.0276 0", "ball overlaps the drum by 0.0001 m: move the ball"),
    ("0 5 0", "ball overlaps the drum by 4.973 m: move the ball"),
    ("0 27 0", "ball overlaps the drum by 26.97 m: move the ball"),  # millimetres
    ("0 1e150 0", "ball overlaps the drum by 1e+150 m: move the ball"),
    ("0 1e300 0", "ball overlaps the drum by "),
    ("0.0176 0.027 0", "ball overlaps an end wall by 0.0001 m: move the ball"),
    ("-7.0175 0.027 0", "ball overlaps an end wall by 7 m: move the ball"),
    ("0 0.0074 0", "ball overlaps the shaft by 0.0001 m: move the ball"),
    ("0 0 0", "ball overlaps the shaft by 0.0075 m: move the ball"),
    ("-0.01 0.0244 0", "ball overlaps a blade by 0.0001 m: move the ball"),  # its tip
    ("-0.01 0.015 0.0044", "ball overlaps a blade by 0.0001 m: move the ball"),  # its face
    ("-0.01 0.015 0", "ball overlaps a blade by 0.0045 m: move the ball"),
    ("0.01 -0.015 0", "ball overlaps a blade by 0.0045 m: move the ball"),
    (ROWS[0], "ball overlaps the one of line 1 by 0.005 m: move one of them"),
    ("-0.016 0.027 0.0049", "ball overlaps the one of line 1 by 0.0001 m: move one of them"),
    ("0 0.027 0 3e8 0 0", LIGHT),
    ("0 0.027 0 1e200 0 0", LIGHT),
    ("0 0.027 0 0 0 0 0 0 1e200", LIGHT),
]


@pytest.mark.parametrize("row, words", WRONG_ROWS, ids=[ascii(row)[:40] for row, _ in WRONG_ROWS])
def test_a_wrong_row_is_named_with_file_and_line(refused, with_start, tmp_path, row, words):
    if "overlaps the one" in words:  # found in the order of lines: the row is compared with line 1
        with_start("\n".join([ROWS[0], ROWS[1], row, *ROWS[3:]]))
    else:
        with_start("\n".join([*ROWS[:2], row, *ROWS[3:]]) + "\n")
    assert refused("deck.ini").startswith(f"{tmp_path}/start.txt:3: {words}")


# ---- the file as a whole ----

WRONG_FILES = [
    ("empty", b"", "'{}' has 0 rows, but the deck has 20 balls"),
    ("comments", b"# x y z\n\n#\n", "'{}' has 0 rows, but the deck has 20 balls"),
    ("one row", ROWS[0].encode(), "'{}' has 1 rows, but the deck has 20 balls"),
    ("row missing", "\n".join(ROWS[1:]).encode(), "'{}' has 19 rows, but the deck has 20 balls"),
    ("row too many", (SMALL_START + "0 0.02 0").encode(), "{}:21: more rows than the 20 balls"),
    ("1e6 rows", 50_000 * SMALL_START.encode(), "{}:21: more rows than the 20 balls of the deck"),
    ("1e6 blank lines", 1_000_000 * b"\n", "'{}' has 0 rows, but the deck has 20 balls"),
    ("ELF", b"\x7fELF\x02\x01\x01" + 9 * b"\0", "{}:1: " + FORM),
    ("PNG", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "{}:1: " + FORM),
    ("zeros", 100_000 * b"\0", "{}:1: " + FORM),
    ("bytes", bytes(range(256)) * 50, "{}:1: " + FORM),
    ("UTF-16", SMALL_START.encode("utf-16"), "{}:1: " + FORM),
    ("CR alone", SMALL_START.replace("\n", "\r").encode(), "{}:1: " + FORM),
    ("a deck", SMALL.encode(), "{}:1: " + FORM),
    ("XYZ", b"20\nballs\n" + SMALL_START.encode(), "{}:1: " + FORM),
    ("CSV with a head", b"x,y,z\n" + SMALL_START.encode(), "{}:1: " + FORM + HEADER),
    ("head in quotes", b'"x";"y";"z"\n' + SMALL_START.encode(), "{}:1: " + FORM + HEADER),
    ("two BOMs", 2 * b"\xef\xbb\xbf" + SMALL_START.encode(), "{}:1: " + FORM),
]


@pytest.mark.parametrize("content, words", [w[1:] for w in WRONG_FILES], ids=[w[0] for w in WRONG_FILES])
def test_a_file_that_holds_no_start_is_named(refused, with_start, tmp_path, content, words):
    with_start(content)
    complaint = refused("deck.ini")
    place = "" if words.startswith("{}") else "deck.ini:7: [balls] start: "
    assert complaint.startswith(place + words.format(tmp_path / "start.txt"))


@pytest.mark.parametrize(
    "rows, line, mend",
    [
        ("v e\n0 0.9\n1 0.8\n", 1, HEADER),
        ("0;0.9\n1;0.8\n", 1, SEMICOLON),
        ("0,5 0,9\n", 1, COMMA),
        ("0 0.9\nv e\n", 2, ""),
    ],
)
def test_a_header_and_separators_of_a_table_of_restitutions_are_told(refused, write_deck, tmp_path, rows, line, mend):
    write_deck(SMALL.replace("restitution = 0.8", "restitution_table = e.txt"))
    (tmp_path / "e.txt").write_text(rows)
    words = f"{tmp_path}/e.txt:{line}: expected 2 numbers 'v e': speed in m/s, restitution{mend}"
    assert refused("deck.ini") == "deck.ini:19: [contact] restitution_table: " + words


def test_a_start_file_of_a_million_rows_too_many_is_refused_at_its_first(refused, with_start):
    with_start(50_000 * SMALL_START)
    began = time.monotonic()
    refused("deck.ini")
    assert time.monotonic() - began < 10


@pytest.mark.parametrize(
    "name, words",
    [
        (".", "cannot read '{}/.': Is a directory"),
        ("none.txt", "cannot read '{}/none.txt': No such file or directory"),
        ("deck.ini/start.txt", "cannot read '{}/deck.ini/start.txt': Not a directory"),
        ("loop", "cannot read '{}/loop': Too many levels of symbolic links"),
        (300 * "n", "cannot read '{}/" + 60 * "n"),
        ("/dev/zero", "'/dev/zero' is a device, not a file"),  # without an end
        ("/dev/null", "'/dev/null' is a device, not a file"),
    ],
)
def test_a_start_that_is_no_file_is_named_with_its_key(refused, write_deck, tmp_path, name, words):
    (tmp_path / "loop").symlink_to("loop")
    write_deck(MILL.replace("start = start.txt", f'start = "{name}"'))
    complaint = refused("deck.ini")
    assert complaint.startswith("deck.ini:7: [balls] start: " + words.format(tmp_path))


def test_a_start_that_is_a_forgotten_pipe_or_a_socket_is_not_waited_for(refused, write_deck, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "socket"))
        for name, words in (
            ("pipe", "is a pipe that nobody writes to"),
            ("socket", "is a socket, not a file"),
        ):
            write_deck(MILL.replace("start.txt", name))
            assert refused("deck.ini") == f"deck.ini:7: [balls] start: '{tmp_path}/{name}' {words}"
            assert refused(name) == f"{name}: {words}"


def test_deck_and_start_may_come_through_pipes_and_redirection(millsim, write_deck, tmp_path):
    write_deck(MILL)
    (tmp_path / "start.txt").write_text(SMALL_START)
    os.mkfifo(tmp_path / "pipe")
    for words in (
        f"{PROGRAM} -qc <(sed s/start.txt/pipe/ deck.ini) -s balls.start=$PWD/pipe & cat start.txt > pipe; wait $!",
        f"{PROGRAM} -qc <(sleep 0.3; cat deck.ini) -s balls.start=$PWD/start.txt",
        f"cat deck.ini | {PROGRAM} -qc /dev/stdin -s balls.start=$PWD/start.txt",
        f"{PROGRAM} -qc /dev/stdin -s balls.start=$PWD/start.txt < deck.ini",
    ):
        done = subprocess.run(["bash", "-c", words], cwd=tmp_path, capture_output=True, text=True, timeout=30)
        assert (done.returncode, done.stderr) == (0, ""), words
        assert "count = 20" in done.stdout


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_start_file_without_permission_is_named_with_its_key(refused, with_start, tmp_path):
    with_start(SMALL_START)
    (tmp_path / "start.txt").chmod(0)
    assert "cannot read" in refused("deck.ini")


@pytest.mark.parametrize(
    "change",
    [
        lambda rows: rows.replace("\n", "\r\n"),
        lambda rows: rows.rstrip("\n"),
        lambda rows: "\ufeff" + rows,
        lambda rows: "\ufeff# x y z\n" + rows,
        lambda rows: rows.replace(" ", ","),
        lambda rows: rows.replace(" ", ", "),
        lambda rows: rows.replace(" ", "\t"),
        lambda rows: "# " + 100_000 * "long " + "\n" + rows.replace("\n", "  # remark: 1 2 3\n"),
        lambda rows: rows.replace("\n", " -0 0e5 +0.000\n"),
    ],
    ids=[
        "CRLF",
        "no newline",
        "BOM",
        "BOM, comment",
        "CSV",
        "CSV, spaced",
        "tabs",
        "comments",
        "at rest",
    ],
)
def test_the_same_positions_written_otherwise_give_the_same_run(millsim, with_start, tmp_path, change):
    sums = []
    for rows in (SMALL_START, change(SMALL_START)):
        with_start(rows)
        done = millsim("deck.ini", "-q", "-f", "-j")
        assert done.returncode == 0, done.stderr
        sums.append([line for line in done.stdout.splitlines() if '_energy"' in line or "work" in line])
    assert len(sums[0]) > 3
    assert sums[0] == sums[1]


# ---- decks without measure ----


@pytest.mark.parametrize(
    "order",
    [
        "=",
        "",
        ".",
        "run.=1",
        "run.time",
        "run.ti\nme=1 s",
        "run.time=1\x07 s",
        "x" * 300 + ".y=1",
        "run." + "y" * 300 + "=1",
    ],
    ids=ascii,
)
def test_an_override_that_is_none_is_refused(refused, write_deck, order):
    write_deck(SMALL)
    assert refused("deck.ini", "-s", order).startswith("--set ")


BESIDE = "count = 20"  # line 4
WRONG_DECKS = {
    "11 000 sections": (SMALL + "".join(f"[balls.k{i}]\n" for i in range(11_000)), "deck.ini:"),
    "1e6 times a section": (SMALL + 1_000_000 * "[run]\n", "deck.ini:23: [run]: the section is"),
    "1e6 letters": (SMALL + 1_000_000 * "x", "deck.ini:23: "),
    "1e5 brackets": (SMALL + 100_000 * "[", "deck.ini:23: "),
    "NUL at the end": (SMALL + "\0", "deck.ini:23: "),
    "NUL in a value": (SMALL.replace(BESIDE, BESIDE + "\0"), "deck.ini:4: "),
    "NUL in a section": (SMALL.replace("[balls]", "[balls\0]"), "deck.ini:3: "),
    "no equals sign": (SMALL.replace(BESIDE, "count 20"), "deck.ini:4: "),
    "value on the next line": (SMALL.replace(BESIDE, "count =\n 20"), "deck.ini:4: "),
    "include key": (
        SMALL.replace(BESIDE, "include = a.ini"),
        "deck.ini:3: [balls] count: missing",
    ),
    "include section": ("[include]\nfile = deck.ini\n" + SMALL, "deck.ini:1: [include]: unknown"),
    "include order": ("!include deck.ini\n" + SMALL, "deck.ini:1: "),
    "include remark": ("#include deck.ini\n", "deck.ini: the deck is empty"),
    "two equals signs": (SMALL.replace(" = ", " == "), "deck.ini:2: [run] time: expected a time"),
    "YAML": (SMALL.replace("[drum]", "drum:"), "deck.ini:7: "),
    "JSON": ('{"run": {"time": 1}}\n', "deck.ini:1: "),
    "XML": ("<deck/>\n", "deck.ini:1: "),
    "a start file": (SMALL_START, "deck.ini:1: "),
}


@pytest.mark.parametrize("name", WRONG_DECKS)
def test_a_deck_without_measure_is_refused_in_a_few_lines(refused, write_deck, name):
    content, words = WRONG_DECKS[name]
    write_deck(content)
    assert refused("deck.ini", most=21)[0].startswith(words)


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null"])
def test_a_device_is_no_deck(refused, device):
    assert refused(device) == f"{device}: is a device, not a file"


def test_a_deck_without_permission_is_a_failure(millsim, write_deck, tmp_path):
    if os.geteuid() == 0:
        pytest.skip("root may read everything")
    write_deck(SMALL).chmod(0)
    done = millsim("deck.ini")
    assert done.returncode == 1
    assert done.stderr == "millsim: deck.ini: cannot be read: Permission denied\n"


# ---- the same in a wavy drum ----

# Five bulges to 34 mm, the first along +y; what stands between comes to 26 mm, once along -y
WAVY = MILL.replace(
    "radius = 30 mm\n", "radius = 30 mm\nprofile = wavy\nbuckles = 5\nbuckle_height = 4 mm\n", 1
).replace("tip_radius = 22 mm", "tip_radius = 18 mm")


@pytest.mark.parametrize(
    "row, words",
    [
        ("0 0.0316 0", "ball overlaps the drum by 0.0001 m: move the ball"),
        ("0 0.04 0", "ball overlaps the drum by 0.0085 m: move the ball"),
        ("0 0.5 0", "ball overlaps the drum by 0.4685 m: move the ball"),
        ("0 -0.0236 0", "ball overlaps the drum by 0.0001 m: move the ball"),
        ("0 -0.0275 0", "ball overlaps the drum by 0.004 m: move the ball"),
    ],
)
def test_a_ball_in_the_wall_of_a_wavy_drum_is_named(refused, write_deck, tmp_path, row, words):
    write_deck(WAVY.replace("count = 20", "count = 1"))
    (tmp_path / "start.txt").write_text(row + "\n")
    assert refused("deck.ini") == f"{tmp_path}/start.txt:1: {words}"


def test_a_ball_in_a_bulge_beyond_the_radius_runs(millsim, write_deck, tmp_path):
    write_deck(WAVY.replace("count = 20", "count = 1"))
    (tmp_path / "start.txt").write_text("0 0.0315 0\n")
    assert millsim("deck.ini", "-q").returncode == 0


def test_buckles_that_let_no_ball_out_are_warned_of(millsim, write_deck):
    text = WAVY.replace("start = start.txt\n", "").replace("buckles = 5", "buckles = 14")
    deck = write_deck(text.replace("buckle_height = 4 mm", "buckle_height = 7 mm"))
    wall = contour.of(Deck.check(deck, ["blades.tip_radius=15 mm"]))
    mouth = 1e3 * (np.hypot(*(wall.centre[1] - wall.centre[3])) - 2 * wall.radius[1])  # between inner arcs
    orders = ("--check", "-q", "deck.ini", "-s", "blades.tip_radius=15 mm", "-s")
    assert millsim(*orders, f"balls.diameter={0.99 * mouth} mm").stderr == ""
    assert millsim(*orders, f"balls.diameter={1.01 * mouth} mm").stderr == (
        f"millsim: warning: deck.ini:11: [drum] buckle_height: the openings of its wall are only "
        f"{mouth:.3g} mm wide, less than a ball's diameter of {1.01 * mouth:.3g} mm: balls that start there stay "
        "there, others do not come in\n"
    )
