"""Points nearest to edges of hulls: answers by construction, and which questions are answered."""

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Convex
from scene_graph_ros.geometry.compiled.lanes import FOUR
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.query.point.edge_lanes import (
    ask_about_edge,
    edge_answer,
    find_edges,
)
from scene_graph_ros.geometry.tables.hull_blocks import vertex, vertex_place
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

HALF = np.array([0.3, 0.2, 0.1])
CORNERS = HALF * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def beside_edges(count, seed):
    """Return points beyond a block's edges, the nearest points on these, and the ways between."""
    rng = np.random.default_rng(seed)
    along = rng.integers(0, 3, count)
    nearest = HALF * rng.choice([-1.0, 1.0], (count, 3))
    way = np.sign(nearest) * rng.uniform(0.1, 1.0, (count, 3))
    rows = np.arange(count)
    way[rows, along] = 0.0
    nearest[rows, along] = HALF[along] * rng.uniform(-0.9, 0.9, count)
    way /= np.linalg.norm(way, axis=1)[:, None]
    return nearest + rng.uniform(1.0, 5.0, (count, 1)) * way, nearest, way


def test_points_beyond_edges():
    """The nearest point of a placed block is the one on the edge that the point was put beyond."""
    table = build_shape_table([Convex(vertices=CORNERS)], [False])
    p_GQ, nearest, way = beside_edges(500, 1)
    X_WG = np.eye(4)
    X_WG[:3, :3] = Rotation.random(random_state=2).as_matrix()
    X_WG[:3, 3] = 0.4, -0.2, 0.7
    points = p_GQ @ X_WG[:3, :3].T + X_WG[:3, 3]
    _, _, phi, p_GN, grad_W, unique = distance_points(table, X_WG[None], points, np.inf)
    np.testing.assert_allclose(phi, np.linalg.norm(p_GQ - nearest, axis=1), rtol=1e-15)
    np.testing.assert_allclose(p_GN, nearest, atol=4e-15)
    np.testing.assert_allclose(grad_W @ X_WG[:3, :3], way, atol=4e-15)
    assert unique.all()


def asked(points, numbers):
    """Return the answers of four questions about the block, each with a corner to begin at."""
    hulls = build_shape_table([Convex(vertices=CORNERS)], [False]).hulls
    blocks, start = hulls.blocks, int(hulls.block_start[0])
    kept = np.empty(8 * FOUR)
    for slot, (point, number) in enumerate(zip(points, numbers, strict=True)):
        corner = vertex(blocks, vertex_place(start, number))
        ask_about_edge(kept, slot, tuple(point), corner, float(number))
    find_edges(kept, blocks, vertex_place(start, 0), len(CORNERS), np.linalg.norm(HALF))
    return [edge_answer(kept, slot) for slot in range(FOUR)]


def corner(x, y, z):
    """Return the number of a corner of the block, by the signs of its coordinates."""
    hulls = build_shape_table([Convex(vertices=CORNERS)], [False]).hulls
    blocks, start = hulls.blocks, int(hulls.block_start[0])
    places = [vertex(blocks, vertex_place(start, k)) for k in range(len(CORNERS))]
    return places.index(tuple((HALF * (x, y, z)).tolist()))


def test_an_edge_is_found_from_either_end():
    """And its other end where that is nearest."""
    ends = corner(1, 1, 1), corner(-1, 1, 1)
    beside, beyond = [0.1, 1.2, 1.1], [-2.3, 1.2, 0.6]
    answers = asked([beside, beside, beyond, beyond], [*ends, ends[0], ends[0]])
    assert all(is_found for is_found, _ in answers)
    for _, (phi, p_GN, grad_G, unique) in answers[:2]:
        np.testing.assert_allclose(p_GN, [0.1, 0.2, 0.1], rtol=1e-15)
        assert unique
        np.testing.assert_allclose(phi, np.sqrt(2.0), rtol=1e-15)
        np.testing.assert_allclose(grad_G, np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0), atol=1e-15)
    for _, (phi, p_GN, _, _) in answers[2:]:
        assert p_GN == (-0.3, 0.2, 0.1)
        np.testing.assert_allclose(phi, np.linalg.norm([2.0, 1.0, 0.5]), rtol=1e-15)


def test_what_takes_more_than_a_step_is_left():
    """Points nearest to a face, to the corner itself, close by, and to an edge further on."""
    number = corner(1, 1, 1)
    left = [[0.05, 0.05, 2.0], [2.0, 2.0, 2.0], [0.0, 0.21, 0.11], [-2.3, 0.0, 1.1]]
    assert not any(is_found for is_found, _ in asked(left, [number] * FOUR))
