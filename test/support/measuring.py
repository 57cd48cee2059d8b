"""Ask the batch kernels about one pair or one shape, and check what every answer must satisfy."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.shape_table import build_shape_table


@dataclass(frozen=True)
class Pair:
    """The answer for one pair; positions and normal are in W."""

    distance: float
    p_WCa: np.ndarray
    p_WCb: np.ndarray
    nhat_BA_W: np.ndarray
    unique: bool
    scale: float


@dataclass(frozen=True)
class Point:
    """The answer for one point; the nearest point is in G, the gradient in W."""

    distance: float
    p_GN: np.ndarray
    grad_W: np.ndarray
    unique: bool


def pose(p=(0.0, 0.0, 0.0), rotation_vector=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Return the (4, 4) pose of a translation and a rotation vector."""
    X = np.eye(4)
    X[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    X[:3, 3] = p
    return X


X_WORLD = pose((1 / 3, -2 / 7, 0.6), (0.3, -0.5, 0.2))
"""A frame to look from, so that no test is about the world's axes."""


def measure(
    shape_A, shape_B, X_WA, X_WB, *, triangles=(False, False), max_distance=np.inf
) -> Pair:
    """Return the signed distance of two shapes.

    ``triangles`` says which of them, being meshes, are measured by their triangles; it holds also
    for convex meshes, whose hull would give the same answer.
    """
    table = build_shape_table([shape_A, shape_B], triangles)
    table = table._replace(exact=np.array(triangles))
    X_WG = np.ascontiguousarray(np.stack([X_WA, X_WB]))
    pairs = np.array([[0, 1]], dtype=np.int64)
    solved = solve_pairs(hold(table), X_WG, pairs, float(max_distance), WITHIN)
    return Pair(
        solved.distance[0],
        solved.p_WCa[0],
        solved.p_WCb[0],
        solved.nhat_BA_W[0],
        bool(solved.is_unique[0]),
        float(table.scale.max()),
    )


def measure_both_ways(shape_A, shape_B, X_WA, X_WB, **options) -> Pair:
    """Return ``measure``'s answer after checking it, seen from elsewhere and swapped, too."""
    triangles = options.pop("triangles", (False, False))
    pair = measure(shape_A, shape_B, X_WA, X_WB, triangles=triangles, **options)
    check_pair(pair)
    X_VW = X_WORLD
    moved = measure(shape_A, shape_B, X_VW @ X_WA, X_VW @ X_WB, triangles=triangles, **options)
    check_pair(moved)
    swapped = measure(shape_B, shape_A, X_WB, X_WA, triangles=triangles[::-1], **options)
    check_pair(swapped)
    tolerance = 1e-12 * reach(pair)
    assert abs(moved.distance - pair.distance) <= tolerance
    assert abs(swapped.distance - pair.distance) <= tolerance
    if pair.unique:
        assert np.allclose(swapped.nhat_BA_W, -pair.nhat_BA_W, rtol=0, atol=1e-7)
    return pair


def reach(pair: Pair) -> float:
    """Return the length that rounding is relative to: the shapes' size or their distance."""
    return pair.scale + np.abs(pair.p_WCa).max() + abs(pair.distance)


def check_pair(pair: Pair) -> None:
    """Check the identities that tie the fields of a pair's answer."""
    assert np.isfinite(pair.distance)
    assert abs(np.linalg.norm(pair.nhat_BA_W) - 1.0) <= 1e-14
    residual = pair.p_WCa - pair.p_WCb - pair.distance * pair.nhat_BA_W
    assert np.abs(residual).max() <= 2e-15 * reach(pair)


def measure_points(shape, p_GQs, X_WG=None, threshold=np.inf) -> list[Point]:
    """Return the answers for points given in the shape's frame."""
    X_WG = np.eye(4) if X_WG is None else X_WG
    table = build_shape_table([shape], [False])
    p_WQs = np.ascontiguousarray(np.atleast_2d(p_GQs) @ X_WG[:3, :3].T + X_WG[:3, 3])
    columns = distance_points(table, np.ascontiguousarray(X_WG[None]), p_WQs, float(threshold))
    _, _, phi, p_GN, grad_W, unique = columns
    return [Point(*row) for row in zip(phi, p_GN, grad_W, map(bool, unique), strict=True)]


def measure_point(shape, p_GQ) -> Point:
    """Return the answer for one point, checked: p_GQ - p_GN = phi grad, and a unit gradient."""
    (answer,) = measure_points(shape, [p_GQ])
    # Of a plate near its centre both are small; what is a tie goes by the shape's size.
    size = np.abs(p_GQ).max() + max(
        np.abs(answer.p_GN).max(), build_shape_table([shape], [False]).scale[0]
    )
    residual = np.asarray(p_GQ) - answer.p_GN - answer.distance * answer.grad_W
    assert np.abs(residual).max() <= 1e-14 * size
    assert abs(np.linalg.norm(answer.grad_W) - 1.0) <= 1e-14
    return answer


def nearest_on_triangle(p, a, b, c):
    """Return the point of a triangle nearest to p: the best of its plane, edges and corners."""
    candidates = [a, b, c]
    for start, end in ((a, b), (b, c), (c, a)):
        t = (p - start) @ (end - start) / ((end - start) @ (end - start))
        candidates.append(start + np.clip(t, 0.0, 1.0) * (end - start))
    normal = np.cross(b - a, c - a)
    foot = p - normal * ((p - a) @ normal) / (normal @ normal)
    weights = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), foot - a, rcond=None)[0]
    if weights.min() >= 0.0 and weights.sum() <= 1.0:
        candidates.append(foot)
    return min(candidates, key=lambda x: np.linalg.norm(p - x))


def polytope_distance(vertices_A, vertices_B) -> float:
    """Return the signed distance of two convex polytopes, by the hull of their differences.

    The origin's depth in that hull is the penetration depth, its distance to it the distance.
    """
    differences = (vertices_A[:, None] - vertices_B[None]).reshape(-1, 3)
    hull = ConvexHull(differences)
    offsets = hull.equations[:, 3]
    if offsets.max() <= 0.0:
        return offsets.max()
    origin = np.zeros(3)
    return min(
        np.linalg.norm(nearest_on_triangle(origin, *differences[simplex]))
        for simplex, offset in zip(hull.simplices, offsets, strict=True)
        if offset > 0.0
    )


def box_vertices(size, X) -> np.ndarray:
    """Return the (8, 3) corners of a box of the given full extents at pose X."""
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return signs * np.asarray(size) / 2 @ X[:3, :3].T + X[:3, 3]
