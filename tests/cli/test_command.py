"""The command: options, what it refuses, exit status, signals."""

import contextlib
import errno
import fcntl
import json
import os
import pathlib
import pty
import re
import resource
import select
import shutil
import signal
import struct
import subprocess
import termios
import threading
import time

import pytest
from conftest import PROGRAM, ROOT, SMALL, SMALL_START

OPTIONS = (
    "output set soft check resume force json quiet progress export-start value digest examples paranoid help version"
).split()
FULL = pathlib.Path("/dev/full")


def test_help_goes_to_standard_output(millsim):
    for option in ("-h", "--help"):
        result = millsim(option)
        assert result.returncode == 0
        assert result.stderr == ""
        for name in OPTIONS:
            assert f"--{name}" in result.stdout
        assert "(INT, TERM, HUP or XCPU)" in result.stdout
        assert max(len(line) for line in result.stdout.splitlines()) <= 90


def test_version_is_one_line_with_the_version_and_the_commit(millsim):
    version = re.escape((ROOT / "VERSION").read_text().strip())
    commit = r"\+g[0-9a-f]{7,}(\.dirty)?" if (ROOT / ".git").exists() else r"(\+g[0-9a-f]{7,})?"
    for option in ("-V", "--version"):
        result = millsim(option)
        assert result.returncode == 0
        assert re.fullmatch(rf"millsim {version}{commit}\n", result.stdout)


@pytest.mark.parametrize(
    "arguments, complaint",
    [
        ([], "no deck given; see millsim --help"),
        (["--foo", "deck.ini"], "unknown option '--foo'; see millsim --help"),
        (["-x", "deck.ini"], "unknown option '-x'; see millsim --help"),
        (["deck.ini", "-qx"], "unknown option '-x'; see millsim --help"),
        (["deck.ini", "--output"], "option '--output' needs a value; see millsim --help"),
        (["deck.ini", "-o"], "option '-o' needs a value; see millsim --help"),
        (["deck.ini", "-o", ""], "option '--output' needs the name of a file"),
        (["--progress=xml", "deck.ini"], "option '--progress' takes json, got 'xml'"),
        (
            ["-q", "--progress=json", "deck.ini"],
            "options '--progress' and '--quiet' exclude each other: --quiet and --check show no progress",
        ),
        (["--check=yes", "deck.ini"], "option '--check' takes no value; see millsim --help"),
        (
            ["deck.ini", "b.ini"],
            "one deck at a time, got 'deck.ini' and 'b.ini'; see millsim --help",
        ),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(millsim, small_deck, arguments, complaint):
    result = millsim(*arguments)
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr == f"millsim: {complaint}\n"


# ---- output that fails ----


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["--check", "deck.ini"]])
def test_a_full_disk_is_a_failure(millsim, small_deck, arguments):
    with FULL.open("w") as full:
        result = millsim(*arguments, stdout=full)
    assert result.returncode == 1
    expected = "millsim: cannot write to standard output: No space left on device\n"
    assert result.stderr == expected


@pytest.mark.parametrize("arguments", ["--help", "--check deck.ini"])
def test_a_closed_standard_output_is_a_failure(tmp_path, small_deck, arguments):
    command = f"exec {PROGRAM} {arguments} >&-"
    result = subprocess.run(["sh", "-c", command], cwd=tmp_path, stderr=subprocess.PIPE, text=True, check=False)
    assert result.returncode == 1
    assert result.stderr.startswith("millsim: cannot write to standard output: ")


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
def test_a_summary_that_cannot_be_written_is_a_failure(millsim, small_deck):
    with FULL.open("w") as full:
        result = millsim("--json", "-q", "deck.ini", stdout=full)
    assert result.returncode == 1
    assert "cannot write to standard output" in result.stderr


def test_a_stack_that_is_too_small_is_made_larger_or_told(millsim, small_deck):
    def run(soft, hard):
        limits = (1024 * soft, 1024 * hard)
        return millsim("-q", "deck.ini", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, limits))

    if resource.getrlimit(resource.RLIMIT_STACK)[1] not in (-1, resource.RLIM_INFINITY):
        pytest.skip("the hard limit of the stack cannot be set back")
    assert run(100, 1024).returncode == 0
    done = run(100, 100)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        "millsim: the stack may take 100 kB only, and 256 kB are needed: 'ulimit -s 256' raises the limit\n"
    )


@pytest.mark.slow
@pytest.mark.unmeasured
def test_too_little_memory_is_told_as_that(millsim, small_deck):
    """Also while UDUNITS-2 reads its database, which crashes or exits by itself."""

    def check(kilobytes):
        def limit():
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_AS, (1024 * kilobytes, 1024 * kilobytes))

        return millsim("--check", "-q", "deck.ini", preexec_fn=limit)

    too_little, enough = 1_000, 200_000
    if check(enough).returncode != 0:
        pytest.skip("this build needs more room than that: sanitizers do")
    while enough - too_little > 50:
        middle = (too_little + enough) // 2
        if check(middle).returncode == 0:
            enough = middle
        else:
            too_little = middle
    told = 0
    for less in range(0, 3000, 100):
        done = check(too_little - less)
        if done.returncode == 127:  # the program did not begin
            break
        assert done.returncode in (0, 1), done
        if done.returncode == 1:
            # libraries may have said something before
            last = done.stderr.splitlines()[-1]
            assert last.startswith("millsim: out of memory") or last.endswith(os.strerror(errno.ENOMEM))
            told += 1
    assert told > 0


@pytest.mark.skipif(not shutil.which("cc"), reason="needs a C compiler")
def test_a_fault_in_gsl_does_not_abort(millsim, small_deck, tmp_path):
    """In place of GSL's solver comes one that fails, and says so as GSL does. Then it has no opinion."""
    (tmp_path / "none.c").write_text(
        "#include <stdio.h>\n"
        "int gsl_error(const char *, const char *, int, int);\n"
        "int gsl_poly_complex_solve(const double *a, unsigned long n, void *room, double *z)\n"
        "{\n"
        '    fputs("asked\\n", stderr);\n'
        '    gsl_error("it does not converge", __FILE__, __LINE__, 5);\n'
        "    return 5;\n"
        "}\n"
    )
    subprocess.run(["cc", "-shared", "-fPIC", "-o", "none.so", "none.c"], cwd=tmp_path, check=True)
    short = ("-s", "run.time=1 ms", "-s", "run.sample_from=0 s")
    done = millsim("--paranoid", "--quiet", *short, "deck.ini", env={"LD_PRELOAD": str(tmp_path / "none.so")})
    if "ASan runtime" in done.stderr:
        pytest.skip("sanitizers want to be loaded first")
    assert done.returncode == 0 and "asked" in done.stderr and "all held" in done.stderr, done.stderr


# ---- where the output goes ----


def test_the_output_is_named_after_the_deck_in_the_current_folder(millsim, write_deck, tmp_path):
    (tmp_path / "decks").mkdir()
    write_deck(name="decks/my.mill.ini")
    assert millsim("-q", "decks/my.mill.ini").returncode == 0
    assert (tmp_path / "my.mill.h5").exists()


def test_the_output_may_be_named(millsim, small_deck, tmp_path):
    assert millsim("-q", "deck.ini", "-o", "other.h5").returncode == 0
    assert (tmp_path / "other.h5").exists()
    assert not (tmp_path / "deck.h5").exists()


def test_an_existing_output_is_refused_and_kept(millsim, small_deck, tmp_path):
    (tmp_path / "deck.h5").write_text("precious")
    result = millsim("deck.ini")
    assert result.returncode == 2
    expected = (
        "deck.h5: exists already; --resume goes on with an interrupted run, --force overwrites it, "
        "-o gives another name"
    )
    assert result.stderr == f"millsim: {expected}\n"
    assert (tmp_path / "deck.h5").read_text() == "precious"


def test_force_overwrites(millsim, small_deck, tmp_path):
    (tmp_path / "deck.h5").write_text("precious")
    result = millsim("-q", "--force", "deck.ini")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "deck.h5").read_bytes()[:4] == b"\x89HDF"


@pytest.mark.parametrize(
    "output, complaint",
    [
        ("none/deck.h5", "cannot be written: its folder: No such file or directory"),
        ("deck.ini/deck.h5", "cannot be written: its folder: Not a directory"),
        (".", "is a folder; use -o with the name of a file"),
        ("./", "is a folder; use -o with the name of a file"),
        ("none/", "is not the name of a file"),
        ("deck.ini", "is the deck itself; use -o for another name"),
        ("link.ini", "is the deck itself; use -o for another name"),
        ("start.txt", "is the deck's start file; use -o for another name"),
        ("/dev/null", "is not a regular file; use -o for another name"),
    ],
)
def test_an_impossible_output_is_refused_before_the_run(millsim, small_deck, tmp_path, output, complaint):
    (tmp_path / "start.txt").write_text("0 0.02 0\n")
    (tmp_path / "link.ini").symlink_to("deck.ini")
    deck = small_deck.read_bytes()
    order = ["--set", "balls.start=start.txt", "--set", "balls.count=1"]
    result = millsim("deck.ini", "--force", "-o", output, *order)
    assert result.returncode == 2
    assert result.stderr == f"millsim: {output}: {complaint}\n"
    assert small_deck.read_bytes() == deck
    assert (tmp_path / "start.txt").read_text() == "0 0.02 0\n"


@pytest.mark.parametrize("end", ["part", "lock"])
@pytest.mark.parametrize("option", ["-fo", "-ro", "--export-start"])
@pytest.mark.parametrize(
    "deck, output",
    [
        ("run.{}", "run"),
        ("./run.{}", "folder/../run"),
        ("link.ini", "run"),
        ("hard.ini", "run"),
        ("run.{}", "linked"),
    ],
)
def test_a_deck_in_the_place_of_the_draft_is_refused_and_kept(millsim, write_deck, tmp_path, end, option, deck, output):
    content = write_deck(name=f"run.{end}").read_bytes()
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.ini").symlink_to(f"run.{end}")
    (tmp_path / "hard.ini").hardlink_to(tmp_path / f"run.{end}")
    (tmp_path / "linked").symlink_to("run")
    before = sorted(tmp_path.iterdir())
    result = millsim("-q", option, output, deck.format(end))
    mend = "give it" if option == "--export-start" else "use -o for"
    assert result.stderr == (f"millsim: {output}: its draft or lock file is the deck itself; {mend} another name\n")
    assert result.returncode == 2
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / f"run.{end}").read_bytes() == content


@pytest.mark.parametrize("end", ["part", "lock"])
def test_a_start_file_in_the_place_of_the_draft_is_refused_and_kept(millsim, write_deck, tmp_path, end):
    write_deck(SMALL.replace("count = 20", f"count = 20\nstart = deck.h5.{end}"))
    (tmp_path / f"deck.h5.{end}").write_text(SMALL_START)
    result = millsim("-q", "--force", "deck.ini")
    assert (result.returncode, result.stderr) == (
        2,
        "millsim: deck.h5: its draft or lock file is the deck's start file; use -o for another name\n",
    )
    assert (tmp_path / f"deck.h5.{end}").read_text() == SMALL_START


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused(millsim, small_deck, tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    result = millsim("deck.ini", "-o", "locked/deck.h5")
    assert result.returncode == 2
    assert "cannot be written: its folder: Permission denied" in result.stderr


def test_check_writes_nothing(millsim, small_deck, tmp_path):
    assert millsim("--check", "-q", "deck.ini").returncode == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck.ini"]


# ---- a run ----


def test_a_run_ends_with_a_summary(millsim, small_deck):
    result = millsim("deck.ini")
    assert result.returncode == 0, result.stderr
    for words in ("ball_drum", "rotor power", "rotor torque", "kinetic energy", "energy error", "wall"):
        assert words in result.stdout


@pytest.mark.parametrize("arguments", [[], ["--check"]], ids=["run", "check"])
def test_names_of_files_cannot_drive_the_terminal(millsim, write_deck, tmp_path, arguments):
    (tmp_path / "\033[31m").mkdir()
    (tmp_path / "\033[31m" / "start.txt").write_text(SMALL_START)
    write_deck(SMALL.replace("count = 20", "count = 20\nstart = start.txt"), "\033[31m/a.ini")
    result = millsim("\033[31m/a.ini", "-q", *arguments)
    assert (result.returncode, result.stderr) == (0, "")
    assert "?[31m" in result.stdout
    assert not re.search(r"[\0-\x08\x0b-\x1f\x7f]", result.stdout)


def long_deck(write_deck):
    """A deck that would run for days."""
    text = write_deck().read_text()
    text = text.replace("time = 50 ms", "time = 1 d").replace("frames = 5 ms", "frames = 1 s")
    return write_deck(text + "series = 10 ms\n", "long.ini")


@pytest.mark.slow
def test_a_soft_limit_of_processor_time_ends_the_run_in_order(millsim, write_deck, tmp_path):
    """The system sends SIGXCPU with each second from there on."""
    h5py = pytest.importorskip("h5py")
    text = long_deck(write_deck).read_text()
    write_deck(text.replace("time = 1 d", "time = 1 d\nsample_from = 0 s"), "long.ini")
    done = millsim(
        "-q",
        "long.ini",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (1, resource.RLIM_INFINITY)),
    )
    assert done.returncode == 128 + signal.SIGXCPU
    assert done.stderr == (
        f"millsim: stopped by signal {signal.SIGXCPU:d}; long.h5 holds everything up to then, and --resume goes on\n"
    )
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck.ini", "long.h5", "long.ini"]
    with h5py.File(tmp_path / "long.h5", "r") as file:
        assert file["/run/status"].asstr()[()] == "stopped"


@contextlib.contextmanager
def mostly_halted(process):
    """Meanwhile time passes for the process as ever, but it takes a fifth of the processor time."""
    over = threading.Event()

    def halt():
        while not over.wait(0.05):
            process.send_signal(signal.SIGSTOP)
            time.sleep(0.2)
            process.send_signal(signal.SIGCONT)

    thread = threading.Thread(target=halt)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@pytest.mark.slow
def test_progress_in_a_log_comes_after_two_seconds(start_millsim, write_deck):
    long_deck(write_deck)
    process = start_millsim("long.ini")
    began = time.monotonic()
    with mostly_halted(process):
        line = process.stderr.readline()
    assert 1.5 < time.monotonic() - began < 10
    assert line.endswith("\n") and "\r" not in line
    assert "%" in line and "contacts/s" in line and "left" in line
    process.send_signal(signal.SIGINT)
    process.wait(timeout=20)


@pytest.mark.slow
def test_progress_for_programs_is_an_object_a_line(start_millsim, write_deck):
    long_deck(write_deck)
    process = start_millsim("long.ini", "--progress=json")
    began = time.monotonic()
    with mostly_halted(process):
        told = [json.loads(process.stderr.readline()) for _ in range(5)]
    took = time.monotonic() - began
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=20)
    *more, last = rest.splitlines()
    told += map(json.loads, more)
    assert {frozenset(one) for one in told} == {
        frozenset("state time end share left contacts contacts_per_second wall what".split())
    }
    assert told[0]["time"] == told[0]["contacts"] == 0 and told[0]["left"] is None
    assert [one["state"] for one in told] == ["sampling"] * (len(told) - 1) + ["writing"]
    assert told[4]["time"] > told[1]["time"] > 0 and told[4]["left"] > 0
    assert all(after["wall"] - before["wall"] >= 0.5 for before, after in zip(told, told[1:-1]))
    assert took >= 1.5  # 0.5 s between two, and not one too many
    assert told[4]["end"] == 86400 and told[4]["share"] == pytest.approx(told[4]["time"] / 86400)
    assert last.startswith("millsim: stopped by signal 2;")  # messages are lines as ever


def test_progress_for_programs_says_when_results_are_sampled(millsim, write_deck):
    write_deck(SMALL.replace("time = 50 ms", "time = 50 ms\nsample_from = 20 ms"))
    done = millsim("deck.ini", "--progress=json", "--json")
    states = [json.loads(line)["state"] for line in done.stderr.splitlines()]
    assert states[0] == "settling" and states[-1] == "writing"
    assert json.loads(done.stdout)["sample_from"] == 0.02


def read_terminal(master, seconds):
    """What arrives at the terminal until it is closed or time is up."""
    out, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        if not select.select([master], [], [], 0.1)[0]:
            continue
        try:
            chunk = os.read(master, 4096)
        except OSError:
            break
        if not chunk:
            break
        out += chunk
    return out.decode()


@pytest.mark.parametrize("width", [120, 40, 10, 3])
@pytest.mark.slow
def test_progress_on_a_terminal_is_one_line_that_fits(write_deck, tmp_path, width):
    long_deck(write_deck)
    try:
        master, slave = pty.openpty()
    except OSError as fault:
        pytest.skip(f"no terminal to be had here: {fault}")
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))
    process = subprocess.Popen(
        [PROGRAM, "long.ini"], cwd=tmp_path, stderr=slave, stdout=subprocess.DEVNULL, stdin=slave
    )
    os.close(slave)
    try:
        with mostly_halted(process):
            shown = read_terminal(master, 2.5)
        process.send_signal(signal.SIGINT)
        shown += read_terminal(master, 10)
        assert process.wait(timeout=20) == 130
    finally:
        process.kill()
        os.close(master)
    body, *rest = shown.split("\r\n")
    updates = body.split("\r")[1:]
    assert len(updates) >= 3
    assert all(len(update) < width for update in updates)
    assert width < 10 or "%" in updates[-1]
    assert rest[0].startswith("millsim: ")
