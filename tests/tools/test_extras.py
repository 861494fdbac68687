"""What only some commands need: without it all others work, and theirs is one line that says what to install."""

import os
import re
import subprocess
import sys

import pytest
from conftest import PROGRAM, ROOT, slow, some

from milltools.base import extras

# as a site's hook it is there in every process of the command
BLOCKER = """\
import sys
from importlib.machinery import PathFinder

class Finder(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.split(".")[0] in {blocked!r} else super().find_spec(name, path, target)

sys.meta_path = [Finder if finder is PathFinder else finder for finder in sys.meta_path]
"""


@pytest.fixture
def without(tmp_path):
    """without(modules, *words) runs `mill WORDS`, or Python with -c, where the modules are not installed."""

    def run(modules, *words):
        (tmp_path / "site").mkdir(exist_ok=True)
        (tmp_path / "site/sitecustomize.py").write_text(BLOCKER.format(blocked=set(modules)))
        environment = {
            **os.environ,
            "PYTHONPATH": f"{tmp_path}/site{os.pathsep}{ROOT / 'tools'}",
            "MILLSIM": str(PROGRAM),
        }
        program = [] if words[0] == "-c" else ["-m", "milltools"]
        words = [sys.executable, *program, *map(str, words)]
        return subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)

    return run


ALL = {module for modules in extras.EXTRAS.values() for module in modules}


CORE = """\
import milltools
from milltools.__main__ import dispatch
assert not any([dispatch(words) for words in {}])
r = milltools.load('a.h5')
print(r.power, r.series, r.summary)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "commands",
    some(
        [
            (["plot a.h5 a.png", "compare a.h5 b.h5", "export deck.ini mill.stl", "export a.h5 a.vtp"],),
            (["report a.h5", "compare a.h5 b.h5 --html c.html"],),
        ],
        2,
    ),
)
def test_the_core_works_without_extras(without, millsim, small_deck, commands):
    for seed, name in (("1", "a.h5"), ("2", "b.h5")):
        assert millsim("-q", "deck.ini", "-s", f"run.seed={seed}", "-o", name).returncode == 0
    done = without(ALL, "-c", CORE.format([words.split() for words in commands]))
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr


@pytest.mark.parametrize(
    "extra, module, words",
    slow(
        [
            ("render", "vtkmodules", ("render", "a.h5", "a.png")),
            ("study", "sklearn", ("sweep", "a.study")),
            ("study", "optuna", ("optimize", "a.study")),
            ("study", "pyarrow", ("study", "a.parquet")),
            ("cluster", "distributed", ("sweep", "a.study", "--dask", "local")),
            ("cluster", "psycopg", ("optimize", "a.study", "--storage", "postgresql://x@127.0.0.1:1/y")),
            ("export", "gsd", ("export", "a.h5", "a.gsd")),
            ("export", "pyarrow", ("export", "a.h5", "a.csv")),
            ("export", "xlsxwriter", ("export", "a.h5", "a.xlsx")),
            ("dem", "scipy", ("dem", "deck.ini", "-o", "a.soft.h5")),
            ("mesh", "manifold3d", ("mesh", "a.stl", "-o", "b.stl")),
            ("contour", "ezdxf", ("contour", "a.dxf", "-o", "a.txt")),
        ],
        "cluster",
        "export",
    ),
)
def test_a_missing_package_is_one_line(without, millsim, write_study, tmp_path, extra, module, words):
    write_study()
    assert millsim("-q", "deck.ini", "-o", "a.h5").returncode == 0
    done = without([module], *words)
    package = extras.EXTRAS[extra][module]
    mend = f"run 'make mill EXTRAS={extra}' in {ROOT}"
    assert done.stderr == f"mill {words[0]}: this needs the Python package {package}: {mend}\n"
    assert done.returncode == 1
    assert not any(tmp_path.glob("a*.parquet*")), "a table was begun"


def test_outside_of_a_checkout_pip_is_told(monkeypatch):
    monkeypatch.setattr(extras.engine, "IN_CHECKOUT", False)
    monkeypatch.setattr(extras, "_found", lambda module: False)
    with pytest.raises(extras.UserError, match=re.escape("psutil, vtk: pip install psutil vtk")):
        extras.needs("render")
