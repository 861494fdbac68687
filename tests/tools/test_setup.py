"""tools/setup: what installing must not do, and that the locks say everything."""

import ast
import importlib.metadata
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tomllib

import pytest
from conftest import slow
from packaging.requirements import Requirement

from milltools.base.extras import EXTRAS

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "tools/pyproject.toml").read_text())["project"]
OWN = ("core", "render", "study", "cluster", "export", "dem", "mesh", "contour")


@pytest.fixture
def checkout(tmp_path):
    """The files that tools/setup reads, in a folder of their own."""
    for name in ("tools/setup", "tools/requirements.lock", "tools/pyproject.toml", "tests/requirements.lock"):
        (tmp_path / "checkout" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / "checkout" / name)
    return tmp_path / "checkout"


def setup(checkout, *words):
    return subprocess.run([checkout / "tools/setup", *words], capture_output=True, text=True)


@pytest.mark.slow
def test_a_linked_environment_is_not_emptied(checkout, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "kept").write_text("of another checkout")
    (checkout / ".venv").symlink_to(other)
    run = setup(checkout, "--local", "--python", "core")
    assert run.returncode == 1
    assert run.stderr == ("millsim: .venv is a link, and what it leads to would be emptied: remove the link\n")
    assert (other / "kept").exists()


def test_what_is_missing_is_told_and_nothing_is_made(checkout):
    run = setup(checkout, "--check", "--python", "all", "lint")
    assert run.returncode == 1
    extras = "cluster contour core dem export lint mesh render study"
    assert run.stderr == f"millsim: Python packages are missing: tools/setup --local --python {extras}\n"
    assert not (checkout / ".venv").exists()


def test_an_unknown_extra_is_refused(checkout):
    run = setup(checkout, "--local", "--python", "cores")
    assert (run.returncode, run.stderr) == (2, "tools/setup: unknown extra 'cores'\n")


def test_a_python_that_makes_no_environment_is_mended_by_deps(checkout, tmp_path):
    """Debian's python3 comes without ensurepip."""
    bare = tmp_path / "python3"
    bare.write_text("#!/bin/sh\nexit 1\n")
    bare.chmod(0o755)
    run = subprocess.run(
        [checkout / "tools/setup", "--check", "python"],
        env=os.environ | {"PYTHON": str(bare)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 1 and "apt-get install python3-venv" in run.stderr


def test_another_apt_is_waited_for(checkout, tmp_path):
    """A fake apt-get that finds the lock of the lists taken, and then that of the archives."""
    fakes = {
        "id": "echo 0",
        "apt-get": f"""echo "$@" >>{tmp_path}/calls; n=$(wc -l <{tmp_path}/calls)
            case $n in 1) lock=lists ;; 3) lock=archives ;; *) exit 0 ;; esac
            echo "E: Could not get lock /var/lib/apt/$lock/lock. It is held by process 1 (apt)" >&2; exit 100""",
    }
    for name, text in {**fakes, "python3": "exit 1"}.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    found = os.environ | {"PYTHON": str(tmp_path / "python3"), "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    run = subprocess.run([checkout / "tools/setup", "python"], env=found, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    calls = [line.split()[3] for line in (tmp_path / "calls").read_text().splitlines()]
    assert calls == ["update", "update", "install", "install"]
    assert "  Another apt runs on this machine: waiting for it, until " in run.stdout


@pytest.mark.parametrize("target", slow(["run", "test", "deps"], "run", "test"))
def test_the_targets_of_a_fresh_machine_ask_for_that_python(target):
    make = ["make", "-n", "-C", ROOT, target]
    said = subprocess.run(make, capture_output=True, text=True, check=True).stdout
    asked = [line.split() for line in said.splitlines() if line.startswith("tools/setup ")]
    assert any("python" in words for words in asked), said[:2000]


def name_of(package):
    return re.sub(r"[-_.]+", "-", package).lower()


def sections():
    """{name: {package: version}} of both locks."""
    found, place = {}, None
    for path in ("tools/requirements.lock", "tests/requirements.lock"):
        for line in (ROOT / path).read_text().splitlines():
            if head := re.fullmatch(r"# \[(\w+)\]", line):
                place = found.setdefault(head[1], {})
            elif not line.startswith("#"):
                package, version = line.split("==")
                place[name_of(package)] = version
    return found


def declared(extra):
    if extra == "core":
        return PROJECT["dependencies"]
    return PROJECT["optional-dependencies"][extra]


def closure(requirements):
    """The names of all that is installed for some requirements, by the metadata of what is here: on the oldest Python,
    whose packages need the most others."""
    oldest = {"python_version": "3.11", "python_full_version": "3.11.2"}
    left, seen = [Requirement(text) for text in requirements], set()
    while left:
        one = left.pop()
        if name_of(one.name) == "millsim":
            left += [Requirement(text) for extra in one.extras for text in declared(extra)]
        elif (key := (name_of(one.name), frozenset(one.extras))) not in seen:
            seen.add(key)
            for text in importlib.metadata.distribution(one.name).requires or []:
                other = Requirement(text)
                if other.marker is None or any(other.marker.evaluate({"extra": e} | oldest) for e in ("", *one.extras)):
                    left.append(other)
    return {name for name, _ in seen}


def test_a_package_has_one_version_in_all_sections():
    versions = {}
    for section in sections().values():
        for package, version in section.items():
            assert versions.setdefault(package, version) == version, package


@pytest.mark.parametrize("extra", OWN)
def test_each_extra_is_locked_with_all_that_it_needs(extra):
    locked = sections()
    there = locked["core"].keys() | locked[extra].keys()
    if extra == "cluster":
        there |= locked["study"].keys()  # tools/setup adds it
    for package, version in {**locked["core"], **locked[extra]}.items():
        try:
            if importlib.metadata.version(package) != version:
                pytest.skip(f"{package} is not the locked one")
        except importlib.metadata.PackageNotFoundError:
            pytest.skip(f"{package} is not installed")
    needed = closure(declared(extra))
    assert needed <= there, "needed, but not locked"
    assert there - needed <= closure(declared("core")) | {"flit-core"}, "locked, but not needed"


def imports(path):
    """The packages that a file imports, ours and Python's left out."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [node.module]
        for name in names:
            if (top := name.split(".")[0]) not in sys.stdlib_module_names | {"milltools"}:
                yield top


@pytest.mark.slow
def test_what_is_imported_is_declared():
    found = {name for path in (ROOT / "tools/milltools").rglob("*.py") for name in imports(path)}
    bring = {module: package for extra in EXTRAS.values() for module, package in extra.items()}
    wanted = {name_of(bring.get(name, {"PIL": "pillow"}.get(name, name))) for name in found}
    every = {name_of(Requirement(text).name) for extra in OWN for text in declared(extra)}
    # dask is what distributed schedules, psycopg what sqlalchemy loads for PostgreSQL
    assert wanted | {"millsim", "dask", "psycopg"} == every


@pytest.mark.parametrize("extra", OWN[1:])
def test_the_table_of_extras_is_that_of_the_project(extra):
    names = {name_of(Requirement(text).name) for text in declared(extra)} - {"millsim"}
    assert {name_of(package) for package in EXTRAS[extra].values()} == names
