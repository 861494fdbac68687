"""tests/covered.py and tests/mutants.py: a line of the engine that no test reaches, and a mutant that no test kills,
need a reason, and reasons are of lines that are there."""

import sys

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tests"))

import covered
import mutants


def test_a_line_has_as_many_reasons_as_it_is_missed():
    missed = {"a.c": ["return;", "return;"], "b.c": ["x = 1;"]}
    known = {"a.c": ["return;"], "c.c": ["y = 2;"]}
    assert covered.unexplained(missed, known) == ([("a.c", "return;"), ("b.c", "x = 1;")], [("c.c", "y = 2;")])


def test_reasons_are_of_lines_of_the_engine():
    known = covered.reasons()
    assert known
    for name, lines in known.items():
        there = [line.strip() for line in (ROOT / "src/engine" / name).read_text().splitlines()]
        assert all(there.count(line) >= lines.count(line) for line in lines), name


@pytest.mark.parametrize(
    "ending, text, broken",
    [
        (".c", "if (a < b)", {"if (a <= b)", "if (a > b)", "if (!(a < b))"}),
        (".c", "x += 2 * sqrt(y); /* 1 < 2 */",
         {"x -= 2 * sqrt(y);", "x += 3 * sqrt(y);", "x += 2 / sqrt(y);", "x += 2 * (y);"}),
        (".c", "x[i + 1] = f(a, b);", {"x[i + 1] = f(b, a);", "x[i - 1] = f(a, b);", "x[i + 0] = f(a, b);",
                                       "x[i + 2] = f(a, b);", "x[i + 1 + 1] = f(a, b);", "x[i + 1 - 1] = f(a, b);"}),
        (".c", "const double x[3] = {0.5}, *y = g(\"1 < 2\");", {"const double x[3] = {0.55}, *y = g(\"1 < 2\");"}),
        (".py", "x = min(a, 1.5) if not b else '1 < 2'  # 1 < 2",
         {"x = max(a, 1.5) if not b else '1 < 2'", "x = min(1.5, a) if not b else '1 < 2'",
          "x = min(a, 1.65) if not b else '1 < 2'", "x = min(a, 1.5) if b else '1 < 2'",
          "x = min(a, 1.5) if not (not b) else '1 < 2'"}),
        (".py", "def f(a=1) -> int:\n    a += b", {"a -= b", "pass"}),
        (".py", "y = [k for k in range(3) if k in a and k > 1e-12]",
         {"y = [k for k not in range(3) if k in a and k > 1e-12]", "y = [k for k in range(4) if k in a and k > 1e-12]",
          "y = [k for k in range(3) if k not in a and k > 1e-12]", "y = [k for k in range(3) if k in a or k > 1e-12]",
          "y = [k for k in range(3) if k in a and k >= 1e-12]", "y = [k for k in range(3) if k in a and k < 1e-12]",
          "y = [k for k in range(3) if not (k in a and k > 1e-12)]"}),
    ],
)  # fmt: skip
def test_one_place_is_broken_at_a_time_in_what_decides_numbers(ending, text, broken):
    found = {text[:start] + new + text[end:] for start, end, new in mutants.edits(text, ending)}
    assert {one.split("  #")[0].split(" /*")[0].split("\n")[-1].strip() for one in found} == broken


def test_survivors_are_mutants_of_the_sources():
    known = mutants.reasons()
    for path in {path for path, _, _ in known}:
        there = {(path, one.before, one.after) for _, one in mutants.mutants(path, seed=1)}
        assert {one for one in known if one[0] == path} <= there
    assert all((ROOT / path).exists() for path in mutants.TESTS)
