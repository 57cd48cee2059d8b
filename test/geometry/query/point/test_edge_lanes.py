"""Points nearest to edges of hulls: answers by construction, and which questions are answered."""

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Convex
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.query.point.edge_lanes import answer_on_edges
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes import Asked
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


PLACES = (5, 0, 30, 17)
"""The lanes that four questions are asked in."""


def asked(points, numbers):
    """Return the answers of four questions about the block, each with a corner to begin at.

    Each is (phi, p_GN, grad_W, is_found); whether all were found is checked.
    """
    hulls = build_shape_table([Convex(vertices=CORNERS)], [False]).hulls
    blocks, start = hulls.blocks, int(hulls.block_start[0])
    p_WQs, answers, kept = np.zeros((3, LANES)), np.zeros((8, LANES)), np.zeros(LANES)
    for lane, point, number in zip(PLACES, points, numbers, strict=True):
        p_WQs[:, lane], kept[lane] = point, number
        answers[1:4, lane] = vertex(blocks, vertex_place(start, number))
    question = Asked(tuple(np.eye(3).ravel()), (0.0, 0.0, 0.0), p_WQs.ravel(), answers.ravel(), 0)
    first, extent = vertex_place(start, 0), np.linalg.norm(HALF)
    are_all = answer_on_edges(question, PLACES, kept, blocks, first, len(CORNERS), extent)
    found = [
        (answers[0, j], answers[1:4, j], answers[4:7, j], answers[7, j] == 1.0) for j in PLACES
    ]
    assert are_all == all(is_found for *_, is_found in found)
    return found


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
    assert all(is_found for *_, is_found in answers)
    for phi, p_GN, grad_G, _ in answers[:2]:
        np.testing.assert_allclose(p_GN, [0.1, 0.2, 0.1], rtol=1e-15)
        np.testing.assert_allclose(phi, np.sqrt(2.0), rtol=1e-15)
        np.testing.assert_allclose(grad_G, np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0), atol=1e-15)
    for phi, p_GN, _, _ in answers[2:]:
        assert p_GN.tolist() == [-0.3, 0.2, 0.1]
        np.testing.assert_allclose(phi, np.linalg.norm([2.0, 1.0, 0.5]), rtol=1e-15)


def test_what_takes_more_than_a_step_is_left():
    """Points nearest to a face, to the corner itself, close by, and to an edge further on."""
    number = corner(1, 1, 1)
    left = [[0.05, 0.05, 2.0], [2.0, 2.0, 2.0], [0.0, 0.21, 0.11], [-2.3, 0.0, 1.1]]
    assert not any(is_found for *_, is_found in asked(left, [number] * len(PLACES)))
