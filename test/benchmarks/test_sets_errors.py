"""The benchmark of errors asks every question, and its truths are those of the boxes."""

import itertools
import math

import numpy as np
import pytest

from benchmarks.sets_errors import box_of, error_of, measure, QUESTIONS


def test_every_question_has_an_error_and_a_time():
    """Of one size and two widths: ours is near the truth in each."""
    rows = list(measure((1e3,), (1.0, 1e-2), repeats=1))
    ours = [row for row in rows if row.engine == "ours"]
    assert [(r.question, r.width) for r in ours] == list(itertools.product(QUESTIONS, (1.0, 0.01)))
    for row in ours:
        assert row.error <= 1e-8
        assert 0.0 < row.seconds < math.inf


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_wrong_answer_has_its_error(question):
    """What is off by a thousandth is told to be, in the measure of the question."""
    box = box_of(2.0, 0.1)
    half, corners = box.half, box.corners
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
        "shortest path": 20.0,
    }[question]
    assert error_of(question, box, right) <= 1e-14
    wrong = {
        "Chebyshev centre": box.center + 1e-3 * half[2] * box.Q[2],
        "bounding box": np.add(right, 2e-3),
        "vertices": corners + 2e-3 * box.Q[0],
        "inscribed ellipsoid": right + 1e-3,
        "circumscribed ellipsoid": right - 1e-3,
    }.get(question, right * 1.001)
    assert error_of(question, box, wrong) == pytest.approx(1e-3, rel=1e-9)
