"""The mill command: its tour, its errors, --json, how it is found and how it is interrupted."""

import importlib
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
import types

import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SMALL, STUDY, run_mill
from packaging.version import Version

from milltools import __main__
from milltools.__main__ import COMMANDS
from milltools.base.answer import Answer
from milltools.read.runfile import Run

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM)}


@pytest.mark.parametrize("words", [(), ("--help",), ("-h",)])
def test_the_tour_names_every_command_with_an_example(mill, words):
    done = mill(*words)
    assert done.returncode == 0
    assert done.stderr == ""
    for command in COMMANDS:
        assert re.search(rf"^  {command.name} +{re.escape(command.line)}$", done.stdout, re.M)
        assert f"$ mill {command.example}\n" in done.stdout


def test_the_tour_says_that_there_are_other_mills(mill):
    said = mill("--help").stdout
    assert "input/simoloyer.ini" in said and "planetary" in said and "docs/mills.md" in said


@pytest.mark.slow
def test_the_tour_shows_how_it_was_called(checkout, tmp_path):
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/mill").symlink_to(checkout)
    wide = {**ENVIRONMENT, "COLUMNS": "500"}  # no path is broken at a hyphen
    path = {**wide, "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}
    for words, folder, env, shown in (
        (["./mill"], checkout.parent, wide, "./mill"),
        (["mill"], "/", path, "mill"),
        ([str(checkout)], "/", wide, str(checkout)),
    ):
        done = subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True)
        assert f"    {shown} COMMAND [options] ..." in done.stdout and f"$ {shown} plot " in done.stdout
        done = subprocess.run([*words, "plot", "--help"], cwd=folder, env=env, capture_output=True, text=True)
        assert f"example: {shown} plot" in " ".join(done.stdout.split())


def test_the_tour_fits_a_terminal(mill):
    assert max(map(len, mill().stdout.splitlines())) <= 100


def test_the_tour_needs_no_package():
    code = (
        "import sys; from milltools import __main__ as m; m.dispatch([]); "
        "found = {'numpy', 'h5py', 'matplotlib', 'scipy', 'rich'} & set(sys.modules); "
        "sys.exit(' '.join(found) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c.name)
def test_every_command_keeps_the_form_of_a_command(mill, command):
    module = importlib.import_module(command.module)
    assert module.SUMMARY.endswith(".")
    assert callable(module.add_arguments) and callable(module.run)
    done = mill(command.name, "--help")
    assert done.returncode == 0
    assert done.stdout.startswith(f"usage: mill {command.name} ")
    assert command.example in " ".join(done.stdout.split())


def test_its_version_is_that_of_millsim(mill, millsim):
    done = mill("--version")
    assert done.stdout == millsim("--version").stdout.replace("millsim", "mill")
    assert done.returncode == 0


def test_packages_and_citation_have_the_version_of_the_product():
    """VERSION has the form of tags, 1.0.0-rc1; packages write 1.0.0rc1."""
    version = (ROOT / "VERSION").read_text().strip()
    project = tomllib.loads((ROOT / "tools/pyproject.toml").read_text())["project"]
    cited = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.M).group(1)
    recipe = re.search(r'set version = "(.*)"', (ROOT / "packaging/conda/meta.yaml").read_text()).group(1)
    assert project["version"] == recipe == str(Version(version))
    assert cited == version


@pytest.mark.parametrize(
    "words, line",
    [
        (["polish"], f"mill: unknown command 'polish': one of {', '.join(c.name for c in COMMANDS)}"),
        (["plt"], "mill: unknown command 'plt'; did you mean 'plot'?"),
        (["--vers"], "mill: unknown option '--vers'; see 'mill --help'"),
        (["plot"], "mill plot: expected a run and the name of the picture to write; see 'mill plot --help'"),
        (["plot", "--big", "a", "b"], "mill plot: unrecognized arguments: --big; see 'mill plot --help'"),
        (["plot", "missing.h5", "b.png"], "mill plot: missing.h5: no such file"),
        (["plot", ".", "b.png"], "mill plot: .: is a folder, not the output file of a run"),
    ],
)  # fmt: skip
def test_wrong_usage_is_one_line_and_status_2(mill, words, line):
    done = mill(*words)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", line + "\n")


# a call of every command for test_json_is_one_object, and members that its object has; files a.h5, b.h5, deck.ini,
# drum.ini, a.study and a.parquet are there
CALLS = {
    "studio": ("deck.ini -o studio.html", {"files": ["studio.html"]}),
    "watch": ("a.h5 --no-browser --until-done", {"files": [], "run": "a.h5", "state": "complete"}),
    "plot": ("a.h5 a.png", {"figure": "overview", "files": ["a.png"]}),
    "report": ("a.h5 -o a.html --rerun never", {"files": ["a.html"]}),
    "dose": ("a.h5", {"files": [], "run": "a.h5"}),
    "wear": ("a.h5", {"files": [], "run": "a.h5"}),
    "power": ("drum.ini", {"files": [], "deck": "drum.ini"}),
    "render": ("a.h5 a.png --size 160x120 --quality draft", {"files": ["a.png"], "pictures": 1, "size": [160, 120]}),
    "dem": ("deck.ini --script dem", {"folder": "dem"}),
    "check": ("deck.ini --time 5ms --starts 2 --modulus 100MPa", {"starts": 2, "folder": "deck-check"}),
    "compare": ("a.h5 b.h5 --csv c.csv", {"files": ["c.csv"]}),
    "sweep": ("a.study -o s.parquet --workers 1 --no-picture", {"files": ["s.parquet"]}),
    "optimize": ("a.study -o o.parquet --runs 1 --workers 1", {"files": ["o.parquet"]}),
    "study": ("a.parquet --csv s.csv", {"files": ["s.csv"], "study": "a"}),
    "export": ("a.h5 a.csv --what summary", {"files": ["a.csv"], "rows": 6}),
    "mesh": ("a.obj -o a.stl", {"files": ["a.stl"], "facets": 4, "bytes": 284, "unit": None, "turned_shells": 0}),
    "contour": ("a.txt --draw a.svg", {"files": ["a.svg"], "lines": 1, "arcs": 1, "unit": "m"}),
}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """The files of CALLS."""
    folder = tmp_path_factory.mktemp("json")
    (folder / "deck.ini").write_text(SMALL)
    shutil.copy(ROOT / "input/bond.ini", folder / "drum.ini")
    small = STUDY.replace("300, 600, 900", "300, 600").replace("balls.count = 40..60 step 20\n", "")
    (folder / "a.study").write_text(small)
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    (folder / "a.txt").write_text("1 0 1\n-1 0 0\n")
    for seed, name in ((1, "a.h5"), (2, "b.h5")):
        subprocess.run([PROGRAM, "-q", "deck.ini", "-s", f"run.seed={seed}", "-o", name], cwd=folder, check=True)
    assert run_mill(folder, "sweep", "a.study", "--workers", "1").returncode == 0
    return folder


MARKS = {name: pytest.mark.slow for name in ("check", "compare", "optimize", "sweep", "plot")}
MARKS |= {"render": pytest.mark.render, "report": pytest.mark.thorough}


@pytest.mark.parametrize(
    "command",
    [pytest.param(c, marks=MARKS.get(c.name, ())) for c in COMMANDS],
    ids=lambda c: c.name,
)
def test_json_is_one_object_and_nothing_else(place, command):
    words, members = CALLS[command.name]
    if command.name == "studio" and not (ROOT / "tools/milltools/studio/studio.html").exists():
        pytest.skip("no page of the studio (make studio)")
    done = run_mill(place, command.name, *words.split(), "--json")
    assert done.returncode == 0, done.stderr

    def refuse(text):
        raise AssertionError(f"{text} is not JSON")

    found = json.loads(done.stdout, parse_constant=refuse)
    assert done.stdout.count("\n") == 1
    assert found["command"] == command.name
    assert {name: found[name] for name in members} == members
    for file in found["files"]:
        assert (place / file).exists()


@pytest.mark.slow
def test_json_of_a_comparison_and_a_study_has_the_numbers(place):
    rows = json.loads(run_mill(place, "compare", "a.h5", "b.h5", "--json").stdout)["rows"]
    (power,) = (row for row in rows if row["quantity"] == "rotor_power")
    with Run(place / "a.h5") as run:
        assert power["reference_value"] == pytest.approx(run.statistic("rotor/power"))
    assert power["verdict"] and "reference_error" in power
    found = json.loads(run_mill(place, "study", "a.parquet", "--json").stdout)
    (best,) = found["best"]
    assert best["objective"] == "impacts/all/normal_speed/median_above_floor"
    assert best["value"] == best["objectives"][best["objective"]]["value"] > 0
    assert best["design"].keys() == found["varied"].keys() == {"rotor.speed"}
    assert best["half_95"] is None  # single runs without an error
    assert found["runs"]["done"] == 2 and found["runs"]["complete"] is True


def test_what_a_command_says_of_its_own_goes_to_standard_error_with_json(monkeypatch, capfd):
    talks = types.SimpleNamespace(
        SUMMARY="Talks.",
        add_arguments=lambda parser: None,
        run=lambda arguments: print("by the way") or Answer("text", {"value": math.nan, "list": np.arange(2)}, 3),
    )
    monkeypatch.setattr(importlib, "import_module", lambda name: talks)
    assert __main__.dispatch(["plot", "--json"]) == 3
    out, err = capfd.readouterr()
    assert json.loads(out) == {"command": "plot", "value": None, "list": [0, 1]}
    assert err == "by the way\n"


def test_an_error_leaves_standard_output_empty_with_json(mill):
    done = mill("plot", "missing.h5", "b.png", "--json")
    assert (done.returncode, done.stdout) == (2, "")


def test_without_millsim_the_version_says_what_to_do(mill):
    done = mill("--version", env={"MILLSIM": "/nowhere/millsim"})
    assert (done.returncode, done.stderr) == (
        1,
        "mill: the environment variable MILLSIM is '/nowhere/millsim', which is not a program\n",
    )


def test_a_closed_pipe_is_no_traceback():
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([sys.executable, "-m", "milltools"], env=ENVIRONMENT, stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, b"")


def test_ctrl_c_is_no_traceback(tmp_path):
    """A program in millsim's place that never answers, interrupted once it has been asked."""
    slow = tmp_path / "slow"
    slow.write_text(f"#!/bin/sh\ntouch {tmp_path}/asked\nexec sleep 60\n")
    slow.chmod(0o755)
    process = subprocess.Popen(
        [sys.executable, "-m", "milltools", "--version"],
        env={**ENVIRONMENT, "MILLSIM": str(slow)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while not (tmp_path / "asked").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the whole group
    assert process.communicate(timeout=60) == ("", "mill: interrupted\n")
    assert process.returncode == 130


@pytest.fixture
def checkout(tmp_path):
    """A checkout with the script, this test's Python and its packages, and millsim."""
    root = tmp_path / "a folder; with $(odd) characters"
    (root / ".venv/bin").mkdir(parents=True)
    script = shutil.copy(ROOT / "tools/mill.sh", root / "mill")
    python = root / ".venv/bin/python"
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    python.chmod(0o755)
    (root / ".venv/python.lock").write_text(f"{root}\nwhat is locked\n")
    return script


def test_the_script_works_through_links_from_anywhere(checkout, tmp_path):
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/relative").symlink_to(f"../{checkout.parent.name}/mill")
    (tmp_path / "absolute").symlink_to(tmp_path / "bin/relative")
    for link in (checkout, tmp_path / "bin/relative", tmp_path / "absolute"):
        done = subprocess.run([link, "a file"], cwd="/", env=ENVIRONMENT, capture_output=True, text=True)
        assert done.stderr.startswith("mill: unknown command 'a file'"), link


@pytest.mark.parametrize("stamp", [None, "/where/it/was/before\n"], ids=["none", "moved"])
def test_the_script_without_its_packages_says_what_to_do(checkout, stamp):
    (checkout.parent / ".venv/python.lock").unlink()
    if stamp:
        (checkout.parent / ".venv/python.lock").write_text(stamp)
    done = subprocess.run([checkout], env=ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr == (f"mill: its Python packages are not installed: run 'make' in {checkout.parent}\n")
