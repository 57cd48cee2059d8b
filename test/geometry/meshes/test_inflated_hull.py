"""Hulls whose faces are moved out, by planes and boxes."""

import math

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Convex,
    GeometryFrame,
    GeometryInstance,
    make_convex_hull,
    Mesh,
    ProximityProperties,
    SceneGraph,
)
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.sources import hull_of

CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-2.0, 2.0) for z in (-3.0, 3.0)])


@pytest.mark.parametrize("margin", [0.0, 0.5, 1e-9, 40.0])
def test_a_box_grows_to_a_box(margin):
    """By the margin to each side."""
    hull = hull_of(make_convex_hull(Convex(vertices=CORNERS), margin))
    np.testing.assert_allclose(
        np.sort(hull.vertices, axis=0), np.sort(CORNERS + margin * np.sign(CORNERS), axis=0)
    )
    assert len(hull.vertices) == 8 and len(hull.faces) == 6


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("n", [4, 12, 200])
def test_each_face_moves_by_the_margin(n, size):
    """The support along each normal of the hull is its offset and the margin."""
    points = size * np.random.default_rng(n).normal(size=(n, 3))
    hull = hull_of(Convex(vertices=points))
    grown = hull_of(make_convex_hull(Convex(vertices=points), 0.1 * size))
    reach = (grown.vertices @ hull.normals.T).max(axis=0)
    np.testing.assert_allclose(reach, hull.offsets + 0.1 * size, rtol=0.0, atol=1e-14 * size)
    # Each corner of the tetrahedron is where three faces meet, also after they have moved.
    assert n != 4 or len(grown.vertices) == 4


def test_the_tip_of_a_pyramid_may_become_an_edge():
    """Faces of a tip of four that are not equally steep do not meet in one point any more."""
    tip = np.array([[0, 0, 1], [2, 1, 0], [-2, 1, 0], [-2, -1, 0], [2, -1, 0]], dtype=float)
    grown = hull_of(make_convex_hull(Convex(vertices=tip), 0.2))
    top = grown.vertices[grown.vertices[:, 2] > 0.5]
    # The two steeper faces, z + |y| = 1, meet in y = 0 at 1 + 0.2 sqrt 2; the flatter ones are
    # z + |x| / 2 = 1 + 0.2 sqrt(5) / 2, so that they end it at |x| = 0.2 (sqrt 5 - 2 sqrt 2) < 0:
    # the edge is theirs, in x = 0 at z = 1 + 0.1 sqrt 5, with |y| = 0.2 sqrt 2 - 0.1 sqrt 5.
    half = 0.2 * math.sqrt(2.0) - 0.1 * math.sqrt(5.0)
    expected = [[0.0, -half, 1.0 + 0.1 * math.sqrt(5.0)], [0.0, half, 1.0 + 0.1 * math.sqrt(5.0)]]
    np.testing.assert_allclose(top[np.argsort(top[:, 1])], expected, atol=1e-14)


def test_all_queries_take_the_result():
    """The distance of two boxes is less by both margins."""
    graph = SceneGraph()
    source = graph.register_source("s")
    ids = []
    for name, shape in (
        ("a", make_convex_hull(Convex(vertices=CORNERS), 0.25)),
        ("b", make_convex_hull(Mesh(vertices=CORNERS, faces=_faces()), 0.5)),
    ):
        frame = graph.register_frame(source, GeometryFrame(name))
        ids.append(
            graph.register_geometry(source, frame, GeometryInstance(np.eye(4), shape, name))
        )
        graph.assign_role(source, ids[-1], ProximityProperties())
    context = graph.create_default_context()
    X_WF = np.tile(np.eye(4), (2, 1, 1))
    X_WF[1, 0, 3] = 5.0
    context.set_frame_poses(source, X_WF)
    pair = graph.query_object(context).compute_signed_distance_pair_closest_points(*ids)
    assert pair.distance == pytest.approx(5.0 - 2.0 - 0.75, abs=1e-12)


def _faces():
    hull = hull_of(Convex(vertices=CORNERS))
    order = [int(np.flatnonzero((v == CORNERS).all(axis=1))[0]) for v in hull.vertices]
    return [[order[f[0]], order[f[k]], order[f[k + 1]]] for f in hull.faces for k in (1, 2)]


@pytest.mark.parametrize(
    ("shape", "margin", "message"),
    [
        (Box(1, 1, 1), 0.1, "shape must be a Convex or Mesh"),
        (None, 0.1, "shape must be a Convex or Mesh, not None"),
        (Convex(vertices=CORNERS), -1e-9, "margin must be finite and at least 0, not -1e-09"),
        (Convex(vertices=CORNERS), math.nan, "margin must be finite and at least 0, not nan"),
        (Convex(vertices=CORNERS), math.inf, "margin must be finite and at least 0, not inf"),
        (Convex(vertices=CORNERS), "wide", "margin must be finite and at least 0, not 'wide'"),
        (Convex(vertices=CORNERS[:4]), 0.1, "is flat: it has no volume"),
    ],
)
def test_what_cannot_grow_is_refused(shape, margin, message):
    """By name and value."""
    with pytest.raises(MeshError, match=message):
        make_convex_hull(shape, margin)
