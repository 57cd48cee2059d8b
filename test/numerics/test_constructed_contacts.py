"""Every pair of the eight shapes, every combination of features, both orders, by construction."""

import functools

from hard_corpus.batches import Complaint, complaints, solve, swapped
from hard_corpus.constructed import constructed, DIRECTIONS, pair_of
import numpy as np
import pytest

APART = [1e-6, 2e-3, 0.1]
DEEP = [-1e-6, -2e-3, -2e-2]


@functools.cache
def _cases(distance):
    seeds = (1, 2, 3) if distance in (2e-3, 0.1) else (1,)
    return [case for seed in seeds for case in constructed(distance, seed=seed)]


@functools.cache
def _complaints(distance):
    return complaints(_cases(distance), directions=DIRECTIONS[:40])


@pytest.mark.parametrize("distance", [*APART, 0.0, *DEEP])
def test_all_pairs_are_there(distance):
    """The corpus holds more than 1000 contacts at each distance, of all 35 pairs."""
    cases = _cases(distance)
    assert len({case.label for case in cases}) > 1000
    assert len({pair_of(case) for case in cases}) == 35


@pytest.mark.parametrize("distance", [*APART, 0.0, *DEEP])
def test_distance_witnesses_and_normal_are_those_constructed(distance):
    """The distance is the constructed one, and witnesses and normal prove it, to 1e-12 L."""
    assert _complaints(distance) == []


def _turns(distance):
    """Return Complaints of normals that differ from the constructed ones, or from B against A."""
    cases = [case for case in _cases(distance) if case.label.endswith("roll 0.7")]
    one, two = solve(cases), solve(swapped(cases))
    assert [c.label for c, unique in zip(cases, one.unique, strict=True) if not unique] == []
    assert np.abs(one.distance - two.distance).max() <= 2e-13
    truth = np.array([case.nhat_BA_W for case in cases])
    found = []
    for nhat in (one.nhat_BA_W, -two.nhat_BA_W):
        error = np.abs(nhat - truth).max(axis=1)
        # The rounding of positions, over the 2 mm between the witnesses, is 1e-13.
        found += [
            Complaint(e, case.label, "normal", distance)
            for case, e in zip(cases, error, strict=True)
            if not e <= 1e-11
        ]
    return found


@pytest.mark.parametrize("distance", [2e-3, -2e-3])
def test_normal_is_the_one_constructed(distance):
    """It points out of B, against A's normal at the contact, in both orders, and is unique."""
    assert _turns(distance) == []
