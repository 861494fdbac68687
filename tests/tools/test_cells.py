"""Cells of the maps: their room, and balls of frames spread over them, beside the maps that millsim makes of the
same run."""

from time import process_time

import foreign
import h5py
import numpy as np
import pytest
from conftest import slow
from foreign import DECKS

from milltools.foreign.digest import snapshot_times
from milltools.geometry import contour
from milltools.geometry.cells import Maps


@pytest.mark.parametrize("name", slow(["smooth, backwards", "wavy drum"], "wavy drum"))
def test_frames_at_the_snapshots_times_make_the_maps_of_the_file(tmp_path, name):
    """Frames come at twice the rate of the snapshots, and include them."""
    deck, path = foreign.simulate(tmp_path, DECKS[name])
    maps = Maps(contour.of(deck), deck.number("drum.length"))
    with h5py.File(path) as file:
        balls = file["particles/trajectory"]
        frames = np.argmin(np.abs(balls["position/time"][:] - snapshot_times(deck)[:, None]), axis=1)
        states = (balls[f"{name}/value"][:].astype(float) for name in ("position", "velocity"))
        for place, velocity in zip(*(state[frames] for state in states), strict=True):
            maps.sample(place, velocity, balls["diameter"][:] / 2)
        for view, cells, axes in (("cross_section", maps.cross, "xyz"), ("axial", maps.axial, ("x", "r", "phi"))):
            stored = file[f"statistics/maps/{view}"]
            volume, solid = cells.flow[0].reshape(cells.n), stored["solid_fraction"][:]
            room = cells.room.reshape(cells.n) * maps.samples
            assert np.array_equal(room > 0, ~np.isnan(solid))
            inside = room > 0
            off = np.abs(volume[inside] / room[inside] - solid[inside])
            assert off.sum() <= 1e-4 * solid[inside].sum()
            full = volume > volume[volume > 0].mean()
            for axis, flow in zip(axes, cells.flow[1:], strict=True):
                off = np.abs(flow.reshape(cells.n)[full] / volume[full] - stored[f"velocity_{axis}"][:][full])
                assert np.mean(off < 1e-5) > 0.98 and off.max() < 0.02, axis


def test_a_snapshot_of_4000_balls_costs_less_than_five_milliseconds():
    maps = Maps(contour.Contour([(0.075, 0, 1), (-0.075, 0, 1)]), 0.12)
    r, v = np.random.default_rng(1).uniform(-0.05, 0.05, (2, 4000, 3))
    seconds = []
    for _ in range(3):
        before = process_time()
        maps.sample(r, v, np.full(4000, 0.0025))
        seconds.append(process_time() - before)
    assert min(seconds) < 5e-3
