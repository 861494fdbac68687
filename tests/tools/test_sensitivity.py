"""Which key matters: indices of Ishigami's function, known exactly, from a plan for them and from any runs."""

import math

import numpy as np
import pandas
import pytest
from scipy.stats import qmc

from milltools.study.search import sensitivity

# Ishigami & Homma 1990 with a = 7, b = 0.1: first and total indices
EXACT = {"a.x": (0.3139, 0.5576), "a.y": (0.4424, 0.4424), "a.z": (0.0, 0.2437)}


class Known:
    """A table of a function over the unit cube."""

    def __init__(self, shares, function, method, seed, error=0.0, keys=tuple(EXACT), samples=0):
        self.meta = {
            "vary": [
                {"key": key, "kind": "number", "unit": "1", "meaning": "", "whole": False, "log": False,
                 "low": 0.0, "high": 1.0, "values": None, "choices": []}
                for key in keys
            ],
            "objectives": [{"path": "y", "goal": "maximise", "unit": "1"}],
            "method": method, "samples": samples, "seed": seed,
        }  # fmt: skip
        rng = np.random.default_rng(seed)
        self._frame = pandas.DataFrame(dict(zip(keys, np.asarray(shares).T)))
        self._frame["y"] = [function(*row) + error * rng.standard_normal() for row in shares]
        self._frame["y:error"] = error or math.nan
        self._frame["status"] = "done"

    def frame(self):
        return self._frame


def ishigami(x, y, z):
    x, y, z = (math.pi * (2 * v - 1) for v in (x, y, z))
    return math.sin(x) + 7 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)


def check(found, method, slack):
    assert [row[0] for row in found] == list(EXACT)
    for key, first, first_ci, total, total_ci, how in found:
        assert how == method
        assert abs(first - EXACT[key][0]) < slack * first_ci < 0.3
        assert abs(total - EXACT[key][1]) < slack * total_ci < 0.6


def test_a_saltelli_plan_gives_the_exact_indices_within_its_intervals():
    shares = sensitivity.saltelli(3, 256, 3)
    assert shares.shape == (256 * 5, 3) and shares.min() >= 0 and shares.max() <= 1
    table = Known(shares, ishigami, "saltelli", 3, samples=256)
    check(sensitivity.indices(table), "saltelli", 1.5)


@pytest.mark.slow
def test_any_runs_give_them_through_a_surface():
    table = Known(qmc.LatinHypercube(3, seed=1).random(220), ishigami, "lhs", 1, error=0.1)
    check(sensitivity.indices(table), "surface", 2.0)


@pytest.mark.slow
def test_a_plan_that_is_not_complete_goes_through_a_surface():
    table = Known(sensitivity.saltelli(3, 16, 3), ishigami, "saltelli", 3, samples=16)
    table._frame = table._frame.iloc[:-5]
    assert {row[5] for row in sensitivity.indices(table)} == {"surface"}


def test_base_points_are_made_a_power_of_two():
    assert len(sensitivity.saltelli(2, 100, 0)) == 128 * 4
    assert np.array_equal(sensitivity.saltelli(2, 100, 0), sensitivity.saltelli(2, 128, 0))


@pytest.mark.slow
def test_a_key_that_does_nothing_has_no_share():
    shares = np.random.default_rng(0).random((40, 2))
    table = Known(shares, lambda x, y: x, "lhs", 0, error=0.01, keys=("a.x", "a.y"))
    (_, first, first_ci, total, *_), (_, other, other_ci, none, none_ci, _) = sensitivity.indices(table)
    assert first == pytest.approx(1, abs=0.05) and total == pytest.approx(1, abs=0.05)
    assert abs(other) < 0.05 and none < 0.05


@pytest.mark.slow
def test_three_designs_for_each_key_and_one_more_are_enough():
    shares = np.random.default_rng(0).random((7, 2))
    found = [sensitivity.indices(Known(shares[:n], lambda x, y: x, "lhs", 0, keys=("a.x", "a.y"))) for n in (6, 7)]
    assert (found[0], len(found[1])) == ([], 2)


def test_the_same_runs_give_the_same_indices():
    table = Known(sensitivity.saltelli(3, 16, 3), ishigami, "saltelli", 3, samples=16)
    assert sensitivity.indices(table) == sensitivity.indices(table)


def test_what_cannot_be_told_is_not():
    few = Known(np.random.default_rng(0).random((5, 3)), ishigami, "lhs", 0)
    assert sensitivity.indices(few) == []
    line = Known(np.random.default_rng(0).random((30, 1)), lambda x: x, "lhs", 0, keys=("a.x",))
    assert sensitivity.indices(line) == []
    still = Known(np.random.default_rng(0).random((30, 2)), lambda x, y: 1.0, "lhs", 0, keys=("a.x", "a.y"))
    assert sensitivity.indices(still) == []
