"""Fixtures of the tests of what users touch. They run $MILLSIM, or else ./millsim of the repository's root."""

import fcntl
import functools
import gc
import os
import pathlib
import re
import shlex
import signal
import subprocess
import sys

import pytest
from marks import SHARED, Costs
from warm import Warm

ROOT = pathlib.Path(__file__).resolve().parents[1]
PROGRAM = pathlib.Path(os.environ.get("MILLSIM", ROOT / "millsim"))
sys.path.insert(0, str(ROOT / "tools"))  # milltools of this checkout, whatever is installed
os.environ["MILL_CALLED"] = "mill"  # the command that messages name

# A mill that runs in well under a second; keys in the order of the lines, so tests can name a line.
SMALL = """\
[run]
time = 50 ms
[balls]
count = 20
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 30 mm
length = 40 mm
[rotor]
speed = 600 rpm
shaft_radius = 5 mm
[blades]
count = 2
tip_radius = 22 mm
width = 6 mm
thickness = 4 mm
[contact]
restitution = 0.8
friction = 0.3
[output]
frames = 5 ms
"""

# Start positions for its balls, along the drum and clear of the blades
SMALL_START = "".join(
    f"{x} {y} {z}\n"
    for x in (-0.016, -0.008, 0.0, 0.008, 0.016)
    for y, z in ((0.027, 0), (-0.027, 0), (0, 0.027), (0, -0.027))
)

# A study of that mill
STUDY = """\
[study]
deck = deck.ini
maximise = impacts/all/normal_speed/median_above_floor
record = rotor/power
[set]
run.time = 60 ms
[vary]
rotor.speed = 300, 600, 900 rpm
balls.count = 40..60 step 20
"""


WAITING = ("test_dask", "test_dem_ends", "test_slurm", "test_slurm_parts", "test_tutorial")
LONG = ("test_report", "test_resume", "test_compare", "test_sweep", "test_study_show", "test_watch")
SLOWER = float(os.environ.get("SLOWER", "1"))  # how much slower programs are while they are measured (make coverage)


def once(factory, name, make):
    """A folder for this run of the tests, filled by make(folder): whichever of the processes of pytest comes first does
    it, the others wait. `factory` is tmp_path_factory."""
    base = factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, made = base / name, base / f"{name}-made"
    with open(base / f"{name}-lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made.exists():
            folder.mkdir()
            make(folder)
            made.touch()
    return folder


def slow(cases, *dear):
    """Cases for parametrize; those with one of the words `dear` in them are `slow`."""
    cases = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*case, marks=[pytest.mark.slow] * any(word in case for word in dear)) for case in cases]


def some(cases, every):
    """Cases for parametrize: the first and each `every`-th after it; the others are `thorough`."""
    cases = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*case, marks=[pytest.mark.thorough] if k % every else []) for k, case in enumerate(cases)]


def pytest_addoption(parser):
    parser.addoption("--marks", action="store_true", help="fail a test whose mark `slow` is not true: marks.py")
    parser.addoption("--costs", metavar="FILE", help="add the processor time of each test to a file")


def pytest_configure(config):
    if not hasattr(config, "workerinput"):
        Warm.open(ROOT / "tools")
    asked = config.getoption("marks"), config.getoption("costs")
    if any(asked):
        config.pluginmanager.register(Costs(*asked))


def pytest_collection_modifyitems(items):
    """Files that take longest come first, so that none of them is left at the end. Files whose tests mostly wait come
    early and not all at once: tests of others fill the cores meanwhile. What needs a dear fixture is slow."""
    files = list(dict.fromkeys(item.path for item in items))
    waiting = [path for path in files if path.stem in WAITING]
    order = sorted((path for path in files if path not in waiting), key=lambda path: path.stem not in LONG)
    for k, path in enumerate(waiting):
        order.insert(4 * k, path)
    items.sort(key=lambda item: order.index(item.path))
    for item in items:
        if SHARED & set(item.fixturenames):
            item.add_marker("slow")


def pytest_collection_finish():
    """What the modules of all tests have loaded stays: garbage collections need not look at it again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20000, 20, 20)


@pytest.fixture(autouse=True, scope="session")
def signals():
    """What nohup or a job in the background ignores, programs would ignore as well; a handler does not reach them."""
    for number, handler in ((signal.SIGHUP, lambda *_: None), (signal.SIGINT, signal.default_int_handler)):
        if signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, handler)


@pytest.fixture
def root():
    """The repository's root."""
    return ROOT


@pytest.fixture
def millsim(tmp_path):
    """millsim(*arguments) runs the program in tmp_path and returns status, stdout and stderr."""
    if not PROGRAM.exists():
        pytest.fail(f"{PROGRAM} is not built; run make first")

    def run(*arguments, timeout=60, stdout=subprocess.PIPE, **options):
        environment = {k: v for k, v in os.environ.items() if not k.startswith("LC_")}
        environment.update(options.pop("env", {}))
        return subprocess.run(
            [PROGRAM, *map(str, arguments)],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            timeout=timeout * SLOWER,
            check=False,
            env=environment,
            **options,
        )

    return run


def lasting(text):
    """What a command said, without the lines of its progress: a slow machine shows more of them."""
    return re.sub(r"^mill \w+: .*(, \d+ %|left)\n", "", text, flags=re.MULTILINE)


def run_mill(cwd, *words, timeout=120, env=None, preexec_fn=None):
    """subprocess.CompletedProcess of `mill WORDS` in the folder cwd, its stderr without progress; env: what its
    environment has in addition."""
    words, timeout = list(map(str, words)), timeout * SLOWER
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM), **(env or {})}
    done = _run_mill(cwd, words, timeout, environment, preexec_fn)
    done.stderr = lasting(done.stderr)
    return done


def _run_mill(cwd, words, timeout, environment, preexec_fn):
    if preexec_fn is None and SLOWER == 1:
        return Warm.run(words, cwd, environment, timeout)
    return subprocess.run(
        [sys.executable, "-m", "milltools", *words],
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout,
        check=False,
        env=environment,
        preexec_fn=preexec_fn,
    )


@pytest.fixture
def mill(tmp_path):
    """mill(*words) runs the mill command in tmp_path and returns status, stdout and stderr: see run_mill."""
    return functools.partial(run_mill, tmp_path)


@pytest.fixture
def start_millsim(tmp_path):
    """start_millsim(*arguments) starts the program in tmp_path; what still runs is ended after the test."""
    started = []

    def start(*arguments):
        process = subprocess.Popen(
            [PROGRAM, *map(str, arguments)],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def write_deck(tmp_path):
    """write_deck(text, name) writes a deck into tmp_path: text or bytes, the small mill by default."""

    def write(text=SMALL, name="deck.ini"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.fixture
def refused(millsim, tmp_path):
    """refused(*arguments): the one line of complaint, after checking that nothing was written. most: the lines, at most
    so many."""

    def check(*arguments, status=2, most=1):
        before = sorted(tmp_path.iterdir())
        result = millsim(*arguments)
        assert (result.returncode, result.stdout) == (status, ""), result.stderr
        assert sorted(tmp_path.iterdir()) == before
        complaints = result.stderr.splitlines()
        assert 1 <= len(complaints) <= most and all(line.startswith("millsim: ") for line in complaints), result.stderr
        complaints = [line.removeprefix("millsim: ") for line in complaints]
        return complaints if most > 1 else complaints[0]

    return check


@pytest.fixture
def printed(millsim):
    """printed(*arguments): {"section.key": value} as `--check` prints it."""

    def check(*arguments):
        result = millsim("--check", "-q", *arguments)
        assert result.returncode == 0, result.stderr
        values, section = {}, None
        for line in result.stdout.splitlines():
            text = re.split(r"\s+#", line)[0].strip() if not line.startswith("#") else ""
            if text.startswith("["):
                section = text.strip("[]")
            elif text:
                key, value = text.split(" = ", 1)
                values[f"{section}.{key}"] = value.strip()
        return values

    return check


@pytest.fixture
def small_deck(write_deck):
    """A small mill that runs in well under a second, as deck.ini in tmp_path."""
    return write_deck()


@pytest.fixture
def write_study(write_deck, the_program):
    """write_study(text, name) writes the small mill as deck.ini and a study deck beside it."""

    def write(text=STUDY, name="a.study"):
        write_deck()
        return write_deck(text, name)

    return write


@pytest.fixture
def the_program(monkeypatch):
    """Python code called in the test itself asks the millsim under test."""
    monkeypatch.setenv("MILLSIM", str(PROGRAM))


@pytest.fixture
def stand_in(tmp_path):
    """stand_in(shell) makes a program in millsim's place: what is no run of a design is millsim's own business; a run
    is logged in `runs` as "PID SEED SPEED", then the shell text is done, then millsim."""

    def make(shell):
        path = tmp_path / "stand-in"
        path.write_text(
            f"""#!/bin/sh
case " $* " in *--value*|*--check*|*--version*|*"run.time=1 ns"*) exec {shlex.quote(str(PROGRAM))} "$@" ;; esac
for word; do case $word in run.seed=*) seed=${{word#*=}} ;; rotor.speed=*) speed=${{word#*=}} ;; esac; done
log={shlex.quote(str(tmp_path))}/runs
echo "$$ $seed $speed" >> "$log"
{shell}
exec {shlex.quote(str(PROGRAM))} "$@"
"""
        )
        path.chmod(0o755)
        return str(path)

    return make
