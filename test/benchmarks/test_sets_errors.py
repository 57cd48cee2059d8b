"""The benchmark of errors asks every question, and its truths are those of the boxes."""

import itertools
import math

import numpy as np
import pytest

from benchmarks.known_boxes import box_of, DECISIONS, DIMENSIONS_OF, error_of, QUESTIONS
from benchmarks.sets_errors import measure


@pytest.mark.parametrize(("dimension", "width"), [(2, 1.0), (3, 1e-2)])
def test_every_question_has_an_error_and_a_time(dimension, width):
    """Ours is near the truth in each, without and with certificates."""
    rows = list(measure((1e3,), (width,), (dimension,), repeats=1))
    ours = [row for row in rows if row.engine == "ours"]
    proven = [row for row in rows if row.engine == "ours, with certificate"]
    assert [row.question for row in ours] == list(QUESTIONS)
    assert [row.question for row in proven] == [*DECISIONS, "region among obstacles"]
    for row in (*ours, *proven):
        assert row.error <= (0.0 if row.question in DECISIONS else 1e-8)
        assert 0.0 < row.seconds < math.inf


def test_corners_are_asked_for_where_they_can_be_listed():
    """In 14 dimensions there are all questions but that of the corners, of which 2^14 are."""
    assert DIMENSIONS_OF == {"vertices": (2, 3, 7)}
    for n in (2, 7, 14):
        box = box_of(1.0, 0.1, n)
        assert box.hull_points.shape[1] == n
        # All are in the ellipsoid around the corners, and some are on it.
        reach = ((box.hull_points - box.center) @ box.Q.T / box.half) ** 2
        assert reach.sum(axis=1).max() == pytest.approx(n, rel=1e-12)


@pytest.mark.parametrize("question", DECISIONS)
def test_a_wrong_decision_is_as_wrong_as_its_gap(question):
    """The largest gap that was told wrongly is the error; what is not shown is wrong, too."""
    box = box_of(2.0, 0.1)
    truths = [case.truth for case in box.cases[question]]
    assert len({repr(truth) for truth in truths}) == 2
    assert error_of(question, box, truths) == 0.0
    for k, case in enumerate(box.cases[question]):
        assert error_of(question, box, [*truths[:k], None, *truths[k + 1 :]]) == case.gap


@pytest.mark.parametrize("question", [q for q in QUESTIONS if q not in DECISIONS])
def test_a_wrong_answer_has_its_error(question):
    """What is off by a thousandth is told to be, in the measure of the question."""
    box = box_of(2.0, 0.1)
    half, corners = box.half, box.corners
    A, b = box.rows
    beyond = 2.0 * math.hypot(0.1, 0.2, 0.05)
    right = {
        "Chebyshev centre": box.center,
        "projection": beyond,
        "bounding box": np.concatenate([corners.min(axis=0), corners.max(axis=0)]),
        "vertices": corners[::-1],
        "volume": 8.0 * half[0] * half[1] * half[2],
        "inscribed ellipsoid": math.log(half[0] * half[1] * half[2]),
        # Its axes are longer than half the box's by the root of 3.
        "circumscribed ellipsoid": math.log(3.0**1.5 * half[0] * half[1] * half[2]),
        "scaling to touch": beyond / 0.02,
        "region among obstacles": (2.0 * A, 2.0 * b),
        "shortest path": 20.0,
    }[question]
    assert error_of(question, box, right) <= 1e-14
    moved = b + 2e-3 * (np.arange(6) == 4)
    wrong = {
        "Chebyshev centre": box.center + 1e-3 * half[2] * box.Q[2],
        "bounding box": np.concatenate([corners.min(axis=0), corners.max(axis=0)]) + 2e-3,
        "vertices": corners + 2e-3 * box.Q[0],
        "inscribed ellipsoid": math.log(half[0] * half[1] * half[2]) + 1e-3,
        "circumscribed ellipsoid": math.log(3.0**1.5 * half[0] * half[1] * half[2]) - 1e-3,
        "region among obstacles": (A, moved),
        "projection": 1.001 * beyond,
        "volume": 8.008 * half[0] * half[1] * half[2],
        "scaling to touch": 1.001 * beyond / 0.02,
        "shortest path": 20.02,
    }[question]
    assert error_of(question, box, wrong) == pytest.approx(1e-3, rel=1e-9)


def test_facing_rows_are_as_far_apart_as_they_are_said_to_be():
    """The rows that decide are each other's negatives, bit by bit."""
    box = box_of(1e-6, 1e-4, 7)
    for case, sign in zip(box.cases["emptiness"], itertools.cycle((1.0, -1.0)), strict=False):
        A, b = case.rows
        np.testing.assert_array_equal(A[0], -A[7])
        assert (b[0] + b[7] < 0.0) == case.truth == (sign < 0.0)
