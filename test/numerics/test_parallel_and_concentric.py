"""Bodies that are parallel but for rounding, and bodies around one centre."""

from hard_corpus.batches import complaints
from hard_corpus.constructed import DIRECTIONS, random_pose
from hard_corpus.extremes import concentric_cases, nearly_parallel_cases
import numpy as np
import pytest

POSES = [np.eye(4), random_pose(np.random.default_rng(5))]


@pytest.mark.parametrize("gap", [2e-3, 1e-9, 0.0, -1e-9, -2e-3])
def test_rods_faces_and_edges_that_are_nearly_parallel(gap):
    """Tilts of 1e-3 to 1e-15 rad and none: the distance is the closed form of the pose given."""
    for X_WA in POSES:
        cases = nearly_parallel_cases(gap, X_WA)
        assert complaints(cases, directions=DIRECTIONS) == []


def test_bodies_around_one_centre():
    """The depth is the least sum of both widths over all directions, half of each."""
    for X_WA in POSES:
        assert complaints(concentric_cases(X_WA), directions=DIRECTIONS) == []
