"""The polytope that EPA grows, beside the convex hull of the same points by Qhull."""

import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from scene_graph_ros.geometry.narrowphase.propose.polytope import (
    add_corner,
    close_face,
    corners_of,
    distance_of,
    empty_polytope,
    is_closed,
    nearest_face,
    normal_of,
    start_tetrahedron,
)

ROUNDING = 1e-14


def _grow(points, room=None):
    """Return (polytope, rows of faces) of points, each of which lies outside of those before.

    There is room for the faces of as many corners, or of ``room``. Ends early if that runs out.
    """
    S = np.zeros((len(points), 9))
    S[:, :3] = points
    polytope = empty_polytope(room or len(points))._replace(S=S)
    count = start_tetrahedron(polytope)
    for corner in range(4, len(points)):
        heights = [
            np.dot(normal_of(polytope.planes, f), points[corner]) - distance_of(polytope.planes, f)
            for f in range(count)
        ]
        count = add_corner(polytope, count, int(np.argmax(heights)), corner, ROUNDING)
        if count < 0:
            break
    return polytope, count


def _living(polytope, count):
    """Return the rows that are faces with an area."""
    return [f for f in range(count) if distance_of(polytope.planes, f) < math.inf]


def _on_ellipsoid(count):
    """Return points that are all corners of their hull, the origin beside its middle."""
    directions = np.random.default_rng(count).normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return directions * [1.0, 0.7, 0.4] + [0.1, 0.05, -0.02]


def _crown(count):
    """Return a ring of points over one, then a point high above the ring, which sees all of it."""
    rng = np.random.default_rng(count)
    angle = np.linspace(0.0, 2.0 * math.pi, count - 2, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), rng.uniform(0.0, 1e-3, count - 2)], axis=1)
    spread = rng.permutation(ring)
    return np.concatenate([spread[:3], [[0.0, 0.0, -1.0]], spread[3:], [[0.0, 0.0, 9.0]]])


SHAPES = [(_on_ellipsoid, 5), (_on_ellipsoid, 12), (_on_ellipsoid, 60)]
SHAPES += [(_crown, count) for count in (9, 10, 11, 18, 40)]


@pytest.mark.parametrize(("draw", "count"), SHAPES)
def test_the_faces_are_those_of_the_hull(draw, count):
    """Whatever the number of edges around the hole that a corner tears."""
    points = draw(count)
    polytope, rows = _grow(points)
    found = {frozenset(corners_of(polytope.faces, f)) for f in _living(polytope, rows)}
    hull = ConvexHull(points)
    assert found == {frozenset(corners) for corners in hull.simplices.tolist()}
    assert len(found) == 2 * count - 4


@pytest.mark.parametrize(("draw", "count"), SHAPES)
def test_planes_are_those_of_the_corners(draw, count):
    """Their normals are of unit length and point away from all other corners."""
    points = draw(count)
    polytope, rows = _grow(points)
    for f in _living(polytope, rows):
        a, b, c = points[list(corners_of(polytope.faces, f))]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        assert np.allclose(normal_of(polytope.planes, f), normal, rtol=0.0, atol=1e-13)
        assert distance_of(polytope.planes, f) == pytest.approx(normal @ a, abs=1e-13)
        assert np.max(points @ normal) <= normal @ a + 1e-12


@pytest.mark.parametrize(("draw", "count"), SHAPES)
def test_neighbors_share_an_edge(draw, count):
    """Each face knows its neighbors and which edges they share, in opposite directions."""
    polytope, rows = _grow(draw(count))
    living = _living(polytope, rows)
    for f in living:
        corners = corners_of(polytope.faces, f)
        for e in range(3):
            g, h = divmod(int(polytope.faces[f, 3 + e]), 4)
            other = corners_of(polytope.faces, g)
            assert g in living
            assert polytope.faces[g, 3 + h] == 4 * f + e
            assert (corners[e], corners[(e + 1) % 3]) == (other[(h + 1) % 3], other[h])


def test_the_nearest_face_is_the_one_of_least_distance_until_it_is_closed():
    """Closing one after the other goes through all of them in order."""
    points = _on_ellipsoid(40)
    polytope, rows = _grow(points)
    hull = ConvexHull(points)
    for least in np.sort(-hull.equations[:, 3]):
        f, distance = nearest_face(polytope.planes, rows)
        assert distance == pytest.approx(least, abs=1e-13)
        assert not is_closed(polytope, f)
        close_face(polytope, f, 100.0)
        assert is_closed(polytope, f)
    assert nearest_face(polytope.planes, rows)[1] == 100.0


def test_a_flat_face_is_never_the_nearest_and_gives_way():
    """A corner on the line of an edge makes a face without area, and the volume is right."""
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.2, 1.0]])
    polytope = empty_polytope(8)
    polytope.S[:4, :3] = flat
    count = start_tetrahedron(polytope)
    # On the line of an edge of the ground, so that one of the new faces has no area.
    polytope.S[4, :3] = [2.0, 0.0, 0.0]
    seen = [f for f in range(count) if np.dot(normal_of(polytope.planes, f), [2.0, 0.0, 0.0])
            > distance_of(polytope.planes, f) + ROUNDING]  # fmt: skip
    count = add_corner(polytope, count, seen[0], 4, ROUNDING)
    assert count > 0
    assert nearest_face(polytope.planes, count)[1] < math.inf
    volumes = [np.linalg.det(polytope.S[list(corners_of(polytope.faces, f)), :3])
               for f in _living(polytope, count)]  # fmt: skip
    assert sum(volumes) / 6.0 == pytest.approx(2.0 * 1.0 * 1.0 / 6.0, rel=1e-12)


def test_what_finds_no_room_is_lost():
    """The polytope says so, and writes nowhere else."""
    assert _grow(_on_ellipsoid(30), room=4)[1] == -1
