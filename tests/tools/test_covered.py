"""tests/covered.py: a line of the engine that no test reaches needs a reason, and reasons are of lines that are
there."""

import sys

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tests"))

import covered


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
