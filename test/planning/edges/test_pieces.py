"""Edges beside a mesh in convex pieces."""

from gantry import gantry_in
import numpy as np
import pytest

from scene_graph_ros.planning import EdgeStatus

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]


def angle():
    """Return an OBJ file of an L: a foot, 3 m long and 1 m high, and a leg of 1 m on its end."""
    lines = []
    for k, (lower, upper) in enumerate([((0, 0, 0), (3, 1, 1)), ((0, 0, 1), (1, 1, 3))]):
        points = np.array(lower) + CORNERS * np.subtract(upper, lower)
        lines.append(f"o part{k}")
        lines += [f"v {x} {y} {z}" for x, y, z in points.tolist()]
        lines += ["f " + " ".join(str(c + 8 * k) for c in side) for side in SIDES]
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("properties", "in_hollow"),
    [
        ("{pieces: objects}", EdgeStatus.FREE),
        ("{pieces: coacd}", EdgeStatus.FREE),
        ("{}", EdgeStatus.COLLIDES),
    ],
)
def test_an_edge_through_the_hollow_is_free_of_the_pieces(tmp_path, properties, in_hollow):
    """It is 0.3 m from both boxes, and inside of the hull of all; another one goes through."""
    checker = gantry_in(angle(), tmp_path, 0.1, properties)
    through_hollow = checker.measure_edge((1.3, 0.5, 1.5), (1.5, 0.5, 1.3))
    assert through_hollow.status is in_hollow
    through_leg = checker.measure_edge((0.5, -2.0, 2.0), (0.5, 3.0, 2.0))
    assert through_leg.status is EdgeStatus.COLLIDES
