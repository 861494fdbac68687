"""The convex outlines of bodies, against Qhull's."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from milltools.geometry.bodies import outermost, outline


@pytest.mark.parametrize("count", [3, 8, 500])
def test_an_outline_has_the_corners_of_the_hull_against_the_clock(count):
    points = np.random.default_rng(count).normal(size=(count, 2))
    found, hull = outline(np.repeat(points, 3, axis=0)), points[ConvexHull(points).vertices]
    assert np.array_equal(np.roll(found, -np.lexsort(found.T)[0], 0), np.roll(hull, -np.lexsort(hull.T)[0], 0))


def test_points_on_a_line_have_its_ends_for_an_outline():
    assert np.array_equal(np.unique(outline(np.array([[1, 1], [0, 0], [2, 2.0]])), axis=0), [[0, 0], [2, 2]])


def test_outermost_points_reach_as_far_as_all():
    """A ball is the worst case: of its points every one is a corner of the hull."""
    random = np.random.default_rng(0)
    points, directions = (r / np.linalg.norm(r, axis=1)[:, None] for r in random.normal(size=(2, 20000, 3)))
    few = outermost(points)
    assert len(few) < 1100 and set(map(tuple, few)) <= set(map(tuple, points))
    assert np.array_equal([few.min(0), few.max(0)], [points.min(0), points.max(0)])
    assert (1 - (few @ directions.T).max(0)).max() < 0.005
