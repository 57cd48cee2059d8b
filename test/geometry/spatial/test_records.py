"""What is wrong with poses and stamps that come in, as one rule each."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np

from scene_graph_ros.geometry.spatial.pose_kernels import FAR_AWAY, NOT_FINITE, NOT_UNIT, VALID
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions
from scene_graph_ros.geometry.spatial.quaternion_kernels import poses_from_components_kernel
from scene_graph_ros.geometry.spatial.record_kernels import (
    are_valid,
    EARLY,
    IN_TIME,
    judge_time,
    judge_times,
    LATE,
    OUT_OF_ORDER,
    place_records,
)
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE, QUATERNION_NORM_DEFECT

ODD = st.sampled_from(
    (0.0, 1.0, -0.8, 1e-320, 1e200, 2.0 * MAX_COORDINATE, math.inf, -math.inf, math.nan)
)
PLACES = st.tuples(ODD, ODD, ODD)
UNITS = st.sampled_from(((0.0, 0.0, 0.0, 1.0), (0.6, 0.0, -0.8, 0.0), (0.5, -0.5, 0.5, 0.5)))
ROWS = st.lists(
    st.tuples(PLACES, UNITS | st.tuples(ODD, ODD, ODD, ODD)).map(lambda both: both[0] + both[1]),
    min_size=1,
    max_size=6,
)
TIMES = st.integers(-5, 5)


def expected_status(row: np.ndarray) -> int:
    """Return what the definition says: finite first, then near, then of unit length."""
    if not np.isfinite(row).all():
        return NOT_FINITE
    if np.abs(row[:3]).max() > MAX_COORDINATE:
        return FAR_AWAY
    # Scaled, so that no square overflows.
    return VALID if abs(math.hypot(*row[3:]) - 1.0) <= QUATERNION_NORM_DEFECT else NOT_UNIT


@given(ROWS)
def test_rows_are_judged_and_the_right_ones_written(rows):
    """Each has the status of its definition, in rows and among bytes; the others stay."""
    components = np.array(rows)
    statuses = [expected_status(row) for row in components]
    X, found = np.full((len(rows), 4, 4), 7.0), np.empty(len(rows), dtype=np.int64)
    count = poses_from_components_kernel(components, X, found)
    assert found.tolist() == statuses
    assert count == statuses.count(VALID)
    for row, status, each in zip(components, statuses, X, strict=True):
        if status == VALID:
            expected = poses_from_quaternions(row[None, :3], row[None, 3:])[0]
            np.testing.assert_array_equal(each, expected)
        else:
            assert (each == 7.0).all()
    numbers = 56 * np.arange(len(rows))
    assert are_valid(components.tobytes(), numbers) == (count == len(rows))


@given(TIMES, TIMES, TIMES, TIMES)
def test_a_time_is_judged(time, newest, earliest, latest):
    """Too early or too late by the clock comes before too early for what it would replace."""
    expected = IN_TIME
    if time < newest:
        expected = OUT_OF_ORDER
    if time > latest:
        expected = LATE
    if time < earliest:
        expected = EARLY
    assert judge_time(time, newest, earliest, latest) == expected


@given(st.lists(st.tuples(TIMES, st.integers(-1, 2)), min_size=1), TIMES, TIMES, TIMES)
def test_times_are_judged_one_by_one(records, now, earliest, latest):
    """Times of 0 stand for now; what has no row is not judged."""
    newest = np.array([-3, 0, 3])
    times, rows = (np.array(each) for each in zip(*records, strict=True))
    given_times, statuses = times.copy(), np.empty(len(records), dtype=np.int64)
    count = judge_times(times, rows, newest, (now, earliest, latest), statuses)
    assert times.tolist() == [time or now for time in given_times.tolist()]
    expected = [
        IN_TIME if row < 0 else judge_time(time, int(newest[row]), earliest, latest)
        for time, row in zip(times.tolist(), rows.tolist(), strict=True)
    ]
    assert statuses.tolist() == expected
    assert count == sum(status != IN_TIME for status in expected)


def test_a_record_that_is_not_in_time_leaves_all_as_they_are():
    """Two poses of one message, of which the second is older than what it would replace."""
    pose = np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]).tobytes()
    stamps = [np.array([second, 0], dtype=np.int32).tobytes() for second in (5, 6)]
    data = stamps[0] + pose + stamps[1] + pose
    X, newest = np.zeros((2, 4, 4)), np.array([0, 7 * 10**9])
    places = np.array([8, 72]), np.array([0, 64])
    limits = (0, -(2**62), 2**62)
    assert not place_records(data, *places, limits, np.array([0, 1]), X, newest)
    assert (X == 0.0).all()
    newest[1] = 0
    assert place_records(data, *places, limits, np.array([0, 1]), X, newest)
    assert newest.tolist() == [5 * 10**9, 6 * 10**9]
    np.testing.assert_array_equal(X[1, :3, 3], [1.0, 2.0, 3.0])
