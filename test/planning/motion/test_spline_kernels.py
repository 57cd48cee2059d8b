"""Fastest splines within limits and half-spaces: as linear programs and closed forms have them."""

import numpy as np
import pytest
from scipy.optimize import linprog

from scene_graph_ros.planning.motion.band_kernels import solve_band
from scene_graph_ros.planning.motion.spline_kernels import fastest_spline, HalfSpaces

SPANS, POSITIONS = 16, 2
LIMITS = np.array([[1.0, 1.5], [4.0, 3.0], [60.0, 80.0]])
HERE = np.array([0.5, 0.5])
"""In the middle of an interval."""


def weights(t):
    """Return how much each of four control points counts at a place in an interval."""
    y = 1.0 - t
    return np.array([y**3, 3 * t**3 - 6 * t**2 + 4, 3 * y**3 - 6 * y**2 + 4, t**3]) / 6.0


def half_spaces(rows):
    """Return half-spaces of an interval, a normal and an offset each, in the middle of it."""
    spans = np.array(sorted({span for span, _, _ in rows}), dtype=np.int64)
    ordered = sorted(rows, key=lambda row: row[0])
    counts = [sum(row[0] == span for row in rows) for span in spans]
    return HalfSpaces(
        spans,
        np.repeat(weights(0.5)[np.newaxis], len(spans), axis=0),
        np.cumsum(counts, dtype=np.int64),
        np.array([row[1] for row in ordered], dtype=float).reshape(-1, POSITIONS),
        np.array([row[2] for row in ordered], dtype=float),
    )


def ends_at(u, ends):
    """Return the six control points that positions, velocities and accelerations at ends say."""
    result = []
    for q, v, a in ends:
        result += [q - v * u + a * u * u / 3, q - a * u * u / 6, q + v * u + a * u * u / 3]
    return np.array(result)


def most_room(u, ends, limits, rows, box):
    """Return how far inside of all bounds a spline can be for u, as a share, and its points."""
    count = SPANS + 3
    size = count * POSITIONS
    upper, right = [], []

    def add(row, most, room):
        upper.append(np.append(row, room))
        right.append(most)

    for j in range(POSITIONS):
        for order, own in enumerate(limits, start=1):
            most = own[j] * u**order
            for i in range(3 - order, count - 3):
                row = np.zeros((count, POSITIONS))
                difference = np.diff(np.eye(order + 1), n=order, axis=0)[0]
                row[i : i + order + 1, j] = difference
                add(row.ravel(), most, most)
                add(-row.ravel(), most, most)
    for span, normal, offset in rows:
        row = np.zeros((count, POSITIONS))
        row[span : span + 4] = -weights(0.5)[:, np.newaxis] * np.array(normal)
        add(row.ravel(), offset, 1.0)
    fixed = np.zeros((6 * POSITIONS, size + 1))
    first = ends_at(u, ends)
    at = [0, 1, 2, count - 3, count - 2, count - 1]
    for row, point in enumerate(at):
        for j in range(POSITIONS):
            fixed[row * POSITIONS + j, point * POSITIONS + j] = 1.0
    cost = np.zeros(size + 1)
    cost[-1] = -1.0
    bounds = [(-box, box)] * size + [(None, 0.9)]
    found = linprog(
        cost, np.array(upper), np.array(right), fixed, first.ravel(), bounds, method="highs"
    )
    if found.status != 0:
        return -1.0, None
    return found.x[-1], found.x[:-1].reshape(count, POSITIONS)


def least_u(ends, limits, rows, box, high):
    """Return the least u for which there is a spline, by halves of an interval."""
    low = 0.0
    for _ in range(22):
        middle = 0.5 * (low + high)
        low, high = (
            (low, middle) if most_room(middle, ends, limits, rows, box)[0] > 0 else (middle, high)
        )
    return high


AT_REST = [(np.zeros(2), np.zeros(2), np.zeros(2)), (np.array([1.0, 0.4]),) + 2 * (np.zeros(2),)]
MOVING = [
    (np.zeros(2), np.array([0.4, -0.2]), np.array([0.5, 0.3])),
    (np.array([1.0, 0.4]), np.array([0.2, 0.1]), np.zeros(2)),
]
ASIDE = [(8, (0.6, 0.8), -1.0), (8, (-1.0, 0.0), 1.0), (5, (0.0, 1.0), -0.35), (11, (0, -1), 1.1)]
"""What is to be kept where: away from the straight way."""


@pytest.mark.parametrize("orders", [2, 3])
@pytest.mark.parametrize("rows", [[], ASIDE], ids=["free", "aside"])
@pytest.mark.parametrize("ends", [AT_REST, MOVING], ids=["at rest", "moving"])
def test_none_is_faster_than_a_linear_program_says(orders, rows, ends):
    """For each u the bounds are linear: the least u for which they can be kept is the answer."""
    limits, box = LIMITS[:orders], 3.0
    begin = 0.25 if ends is MOVING else 1.0
    best = least_u(ends, limits, rows, box, begin)
    room, points = most_room(1.15 * best, ends, limits, rows, box)
    assert room > 0.0
    u = np.array([1.15 * best])
    low, high = np.full((2, SPANS - 3, POSITIONS), [[[-box]], [[box]]])
    steps = fastest_spline(limits, np.array(ends), low, high, half_spaces(rows), points, u, 1e-3)
    assert 0 < steps < 100
    assert best * (1.0 - 1e-6) <= u[0] <= 1.005 * best
    np.testing.assert_allclose(points[[0, 1, 2, -3, -2, -1]], ends_at(u[0], ends), atol=1e-12)
    for order, own in enumerate(limits, start=1):
        inner = np.diff(points, n=order, axis=0)[3 - order : len(points) - 3]
        assert (np.abs(inner) < own * u[0] ** order).all()
    for span, normal, offset in rows:
        assert weights(0.5) @ points[span : span + 4] @ np.array(normal) + offset > 0.0


@pytest.mark.parametrize("others", [6, 7, 8])
def test_positions_that_stay_cost_the_others_no_time(others):
    """With rows of one, two and more than a register: the same least u, among more bounds."""
    least = []
    for first in (0, others):
        ends, k = np.zeros((2, 3, first + POSITIONS)), first + POSITIONS
        ends[:, :, first:] = np.array(AT_REST)
        limits = np.ones((3, k))
        limits[:, first:] = LIMITS
        normals = np.zeros((len(ASIDE), k))
        rows = half_spaces(ASIDE)
        normals[:, first:] = rows.normals
        points = np.zeros((SPANS + 3, k))
        best = least_u(AT_REST, LIMITS, ASIDE, 3.0, 1.0)
        points[:, first:] = most_room(1.15 * best, AT_REST, LIMITS, ASIDE, 3.0)[1]
        low, high = np.full((2, SPANS - 3, k), [[[-3.0]], [[3.0]]])
        u = np.array([1.15 * best])
        rows = rows._replace(normals=normals)
        assert 0 < fastest_spline(limits, ends, low, high, rows, points, u, 1e-3) < 100
        assert np.abs(points[:, :first]).max(initial=0.0) < 1e-3
        least.append(u[0])
    assert abs(least[1] / least[0] - 1.0) < 2e-3


@pytest.mark.parametrize(("n", "width"), [(1, 4), (5, 12), (40, 12), (63, 28), (50, 36)])
def test_a_banded_system_is_solved(n, width):
    """Both right sides, as numpy solves the whole matrix."""
    rng = np.random.default_rng(n)
    root = np.tril(rng.normal(size=(n, n)))
    root[np.subtract.outer(np.arange(n), np.arange(n)) >= width] = 0.0
    matrix = root @ root.T + np.eye(n)
    band, right = np.zeros((n, width + 8)), rng.normal(size=(2, n))
    for p in range(n):
        own = matrix[p, p : p + width]
        band[p, : len(own)] = own
    expected = np.linalg.solve(matrix, right.T).T
    solve_band(band, width, right, np.empty(n))
    np.testing.assert_allclose(right, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_what_begins_outside_of_its_bounds_is_left_as_it_is():
    """A control point outside of its box, a place beyond its half-space, too little time."""
    points = np.repeat(np.linspace(0.0, 1.0, SPANS + 3)[:, np.newaxis], 2, axis=1)
    points[:3], points[-3:] = 0.0, 1.0
    ends = np.zeros((2, 3, 2))
    ends[1, 0] = 1.0
    low, high = np.full((2, SPANS - 3, POSITIONS), [[[-3.0]], [[3.0]]])
    cases = [
        (0.2, low + 3.5, high, half_spaces([])),
        (0.2, low, high, half_spaces([(8, (1.0, 0.0), -2.0)])),
        (0.02, low, high, half_spaces([])),
    ]
    for seconds, *box, rows in cases:
        u, tried = np.array([seconds]), points.copy()
        assert fastest_spline(LIMITS, ends, *box, rows, tried, u, 1e-2) == -1
        assert u[0] == seconds
        np.testing.assert_array_equal(tried, points)
