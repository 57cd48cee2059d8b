"""Many points against many shapes: the batch, its order and its culling."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Sphere,
)
from scene_graph_ros.geometry.query.point.answers import LARGE, new_answers
from scene_graph_ros.geometry.query.point.batch import answer_all, distance_points
from scene_graph_ros.geometry.query.point.kind_table import group_by_kind, hold_kinds
from scene_graph_ros.geometry.tables.shape_table import build_shape_table


def scene(count, seed):
    """Return a table of mixed shapes, their poses and points among them."""
    rng = np.random.default_rng(seed)
    kinds = [
        Sphere(0.1),
        Capsule(0.05, 0.2),
        Box(0.1, 0.2, 0.3),
        Cylinder(0.1, 0.2),
        Ellipsoid(0.05, 0.1, 0.2),
        Convex(vertices=rng.normal(size=(12, 3)) / 10),
        HalfSpace(),
    ]
    table = build_shape_table([kinds[i % 7] for i in range(count)], [False] * count)
    X_WG = np.tile(np.eye(4), (count, 1, 1))
    X_WG[:, :3, :3] = Rotation.random(count, random_state=seed).as_matrix()
    X_WG[:, :3, 3] = rng.uniform(0, 2, (count, 3))
    return table, X_WG, rng.uniform(0, 2, (30, 3))


def test_threshold_equals_filtering():
    """A threshold gives exactly the rows of the full answer within it, in the same order."""
    table, X_WG, points = scene(70, 4)
    full = distance_points(table, X_WG, points, np.inf)
    assert len(full[0]) == 70 * 30
    for threshold in (-0.05, 0.0, 0.1, 0.5, 10.0):
        some = distance_points(table, X_WG, points, threshold)
        kept = full[2] <= threshold
        for column, expected in zip(some, full, strict=True):
            np.testing.assert_array_equal(column, expected[kept])


@pytest.mark.compiled
def test_points_in_step_are_answered_as_alone():
    """Shapes and points of every sort have, bit for bit, the answers of the kernels for one point.

    Those are what a threshold asks, here one that leaves nothing out; needles, plates, centres,
    axes, planes of symmetry and surfaces are among them, and more of a kind than fit in step.
    """
    rng = np.random.default_rng(10)
    corners = rng.normal(size=(12, 3)) / 10
    kinds = [
        Ellipsoid(1e-3, 1.0, 1e-3),
        Ellipsoid(0.1, 0.1, 0.1),
        Ellipsoid(1.0, 1e-3, 1.0),
        Ellipsoid(0.3, 0.2, 0.1),
        Box(1e-3, 1.0, 1.0),
        Cylinder(1e-3, 1.0),
        Capsule(1e-3, 1.0),
        Sphere(0.3),
        HalfSpace(),
        Convex(vertices=corners),
        Convex(vertices=corners[:3]),
        Convex(vertices=rng.normal(size=(60, 3)) * (1.0, 1e-3, 0.1)),
        Mesh(vertices=corners[:4], faces=[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]),
    ]
    count = 20 * len(kinds)
    table = build_shape_table(kinds * 20, [False] * count)
    X_WG = np.tile(np.eye(4), (count, 1, 1))
    X_WG[: count // 2, :3, :3] = Rotation.random(count // 2, random_state=3).as_matrix()
    X_WG[: count // 2, :3, 3] = rng.uniform(-1, 1, (count // 2, 3))
    grid = np.array([-1.0, -1e-3, -1e-17, 0.0, 1e-12, 1e-3, 0.3, 1.0])
    points = np.array([(x, y, z) for x in grid for y in grid for z in grid])
    together = distance_points(table, X_WG, points, np.inf)
    alone = distance_points(table, X_WG, points, 1e6)
    for column, expected in zip(together, alone, strict=True):
        np.testing.assert_array_equal(column, expected)


@pytest.mark.compiled
def test_any_number_of_points_and_rows():
    """Numbers of points and rows that fill no block and no tile are answered as alone, too."""
    for count, rows in ((1, 40), (5, 3), (33, 7), (40, 600), (127, 300)):
        table, X_WG, _ = scene(rows, count)
        points = np.random.default_rng(rows).uniform(0, 2, (count, 3))
        together = distance_points(table, X_WG, points, np.inf)
        alone = distance_points(table, X_WG, points, 1e6)
        for column, expected in zip(together, alone, strict=True):
            np.testing.assert_array_equal(column, expected)


@pytest.mark.compiled
def test_answers_past_the_caches():
    """Large results have the answers of points alone, wherever a point's rows begin in a line.

    Of 1000 rows each point begins a line of the cache, of 1004 each second one, of 1001 each
    eighth; points are left over that fill no lanes.
    """
    for count, rows in ((70, 1000), (75, 1004), (261, 1001)):
        table, X_WG, _ = scene(rows, count)
        points = np.random.default_rng(rows).uniform(0, 2, (count, 3))
        together = distance_points(table, X_WG, points, np.inf)
        alone = distance_points(table, X_WG, points, 1e6)
        for column, expected in zip(together, alone, strict=True):
            np.testing.assert_array_equal(column, expected)


def test_columns_that_begin_anywhere():
    """Columns that begin within a line of the cache are written as those that begin one."""
    table, X_WG, points = scene(1000, 11)
    points = np.tile(points, (3, 1))
    kinds, count = hold_kinds(group_by_kind(table)), 1000 * len(points)
    lined = new_answers(count)
    room = new_answers(count + 8)
    shifted = (room[0][1:], room[1][2:], room[2][5:], room[3][3:])
    for columns in (lined, shifted):
        answer_all(table, kinds, X_WG, points, range(len(points)), columns)
    for column, other in zip(lined, shifted, strict=True):
        np.testing.assert_array_equal(column, other[: len(column)])


def test_large_columns_begin_lines():
    """Columns of many answers begin at multiples of 64 bytes; all have their sizes."""
    assert all(column.ctypes.data % 64 == 0 for column in new_answers(LARGE))
    for count in (0, 1, LARGE, LARGE + 1):
        sizes = [len(column) for column in new_answers(count)]
        assert sizes == [count, 3 * count, 3 * count, count]


def test_sorted_by_point_then_row():
    """Rows of the answer are in the order of points, and of shapes within a point."""
    table, X_WG, points = scene(35, 5)
    point, row = distance_points(table, X_WG, points, 0.3)[:2]
    assert len(point) > 0
    np.testing.assert_array_equal(np.lexsort((row, point)), np.arange(len(point)))


def test_identity_in_world():
    """Each row satisfies p_WQ - p_WN = phi grad_W, with the nearest point moved to W."""
    table, X_WG, points = scene(35, 6)
    point, row, phi, p_GN, grad_W, _ = distance_points(table, X_WG, points, np.inf)
    X = X_WG[row]
    p_WN = np.einsum("nij,nj->ni", X[:, :3, :3], p_GN) + X[:, :3, 3]
    np.testing.assert_allclose(points[point] - p_WN, phi[:, None] * grad_W, atol=1e-14)


def test_nothing_to_ask():
    """No points or no shapes give empty columns of the right shapes."""
    table, X_WG, points = scene(7, 7)
    empty = build_shape_table([], [])
    for answer in (
        distance_points(table, X_WG, points[:0], np.inf),
        distance_points(empty, X_WG[:0], points, np.inf),
    ):
        assert [column.shape for column in answer] == [(0,), (0,), (0,), (0, 3), (0, 3), (0,)]


def test_threads_give_the_same():
    """Any number of threads, more than points too, gives bit for bit what one gives."""
    table, X_WG, points = scene(35, 8)
    for asked in (points, points[:1], points[:0]):
        for threshold in (0.2, 0.5, np.inf):
            alone = distance_points(table, X_WG, asked, threshold)
            for threads in (2, 3, 7, 64):
                shared = distance_points(table, X_WG, asked, threshold, threads)
                for column, expected in zip(shared, alone, strict=True):
                    np.testing.assert_array_equal(column, expected)
                    assert column.shape == expected.shape


def test_room_grows_for_many_answers():
    """More answers within the threshold than there was room for at first are all there."""
    table, X_WG, points = scene(200, 9)
    points = np.tile(points, (10, 1))
    assert len(distance_points(table, X_WG, points, 100.0)[0]) == 200 * 300
    assert len(distance_points(table, X_WG, points, 100.0, 2)[0]) == 200 * 300
