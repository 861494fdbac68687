"""Bins, quantiles and blocks of milltools.tally at their borders, and what a snapshot costs."""

import numpy as np
import pytest
from foreign import cost

from milltools import tally
from milltools.geometry.profile import Profile


def test_blocks_between_two_rows_are_interpolated():
    time = np.linspace(0, 1, 11)
    blocks = tally.Blocks(2 * np.pi / 0.25, 0.05, 1.0)
    blocks.close(time, 3 * time, -2 * time)
    assert len(blocks.power) == 3 and blocks.duration == 0.25
    assert np.allclose(blocks.power, 3) and np.allclose(blocks.torque, -2)


def test_a_block_that_is_not_over_is_not_counted():
    time = np.linspace(0, 0.5, 6)
    blocks = tally.Blocks(2 * np.pi / 0.25, 0.05, 1.0)
    blocks.close(time, 3 * time, -2 * time)
    assert len(blocks.power) == 1


def test_speeds_on_an_edge_belong_to_the_bin_above_it():
    edges = tally.EDGES
    assert tally.find_slots(edges).tolist() == list(range(1, tally.SLOTS))
    assert tally.find_slots(np.nextafter(edges, 0)).tolist() == list(range(tally.SLOTS - 1))
    assert tally.find_slots(np.array([0, -1, np.nan, 1e9])).tolist() == [0, 0, 0, tally.SLOTS - 1]
    assert 0.05 == edges[tally.FAST - 1] and {1.0, 20.0} <= set(edges)


@pytest.mark.parametrize("slot", [0, 1, 700, tally.BINS, tally.SLOTS - 1])
def test_quantiles_of_one_bin_lie_in_it(slot):
    count = np.zeros(tally.SLOTS, np.uint64)
    count[slot] = 4
    lower = tally.EDGES[slot - 1] if slot > 0 else 0
    upper = tally.EDGES[min(slot, tally.BINS)] if slot > 0 else 0
    expected = np.sqrt(lower * upper) if slot <= tally.BINS else tally.EDGES[-1]
    assert tally.quantile(count, 0.5) == pytest.approx(expected, rel=1e-12)
    assert np.isnan(tally.quantile(0 * count, 0.5))


def test_a_snapshot_of_4000_balls_costs_less_than_five_milliseconds():
    maps = tally.Maps(Profile(0.075), 0.12)
    r, v = np.random.default_rng(1).uniform(-0.05, 0.05, (2, 4000, 3))
    assert cost(lambda: maps.sample(r, v, np.full(4000, 0.0025))) < 5e-3
