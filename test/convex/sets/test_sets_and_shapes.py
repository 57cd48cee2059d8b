"""Flat sets of registered geometry, and the shapes that sets are."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Convex,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    HPolyhedron,
    Hyperrectangle,
    Point,
    VPolytope,
)


def simplex(n):
    """All x >= 0 that add up to at most 1."""
    return HPolyhedron(np.vstack([-np.eye(n), np.ones(n)]), np.append(np.zeros(n), 1.0))


def scene():
    """A box, a floor, a tetrahedron and a ball, seen from a turned frame."""
    graph = SceneGraph()
    source = graph.register_source("s")
    frame = graph.register_frame(source, GeometryFrame("f"))
    X_WF = np.eye(4)
    X_WF[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    X_WF[:3, 3] = [1.0, 2.0, 3.0]
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    ids = {}
    for name, shape in {
        "box": Box(2.0, 4.0, 6.0),
        "floor": HalfSpace(),
        "hull": Convex(vertices=corners),
        "ball": Sphere(0.5),
    }.items():
        ids[name] = graph.register_geometry(
            source, frame, GeometryInstance(np.eye(4), shape, name)
        )
    context = graph.create_default_context()
    context.set_frame_poses(source, {frame: X_WF})
    return graph.query_object(context), ids, frame


def test_sets_of_registered_geometry():
    """The box of 2 x 4 x 6, turned by 90 degrees about z, is 4 x 2 x 6 about (1, 2, 3)."""
    query, ids, frame = scene()
    truth = HPolyhedron.make_box([-1.0, 1.0, 0.0], [3.0, 3.0, 6.0])
    for kind in (HPolyhedron, VPolytope):
        made = kind(query, ids["box"])
        made = HPolyhedron(made) if kind is VPolytope else made
        assert made.contained_in(truth, 1e-14)
        assert truth.contained_in(made, 1e-14)
        assert kind(query, ids["box"], frame).point_in_set([0.99, 1.99, 2.99])
        assert kind(query, ids["hull"]).calc_volume() == pytest.approx(1 / 6)
        with pytest.raises(ConvexSetError, match="not a Sphere"):
            kind(query, ids["ball"])
    floor = HPolyhedron(query, ids["floor"])
    assert floor.point_in_set([0.0, 0.0, 3.0]) and not floor.point_in_set([0.0, 0.0, 3.1])
    assert not floor.is_bounded()
    center = Point(query, ids["ball"], maximum_allowable_radius=0.5)
    np.testing.assert_array_equal(center.x, [1.0, 2.0, 3.0])
    with pytest.raises(ConvexSetError, match=r"radius at most 0\.4"):
        Point(query, ids["ball"], maximum_allowable_radius=0.4)


def test_shapes_of_sets(tmp_path):
    """A box back and forth, a tetrahedron, a point; the file of a tetrahedron has 4 faces."""
    shape, X_WG = Hyperrectangle([0.0, 0.0, 0.0], [1.0, 2.0, 3.0]).to_shape_with_pose()
    assert shape == Box(1.0, 2.0, 3.0)
    np.testing.assert_array_equal(X_WG[:3, 3], [0.5, 1.0, 1.5])
    hull, _ = simplex(3).to_shape_with_pose()
    assert isinstance(hull, Convex)
    assert Point([1.0, 2.0, 3.0]).to_shape_with_pose()[0] == Sphere(0.0)
    with pytest.raises(ConvexSetError, match="3 dimensions, the set has 2"):
        simplex(2).to_shape_with_pose()
    VPolytope(simplex(3)).write_obj(tmp_path / "s.obj")
    lines = (tmp_path / "s.obj").read_text().splitlines()
    assert [line[0] for line in lines] == ["v"] * 4 + ["f"] * 4
