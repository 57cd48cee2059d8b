"""What reaches into a region of a scene: which geometry, how deep and where, by construction."""

from __future__ import annotations

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    find_region_cuts,
    HPolyhedron,
    iris,
    scene_obstacles,
    VPolytope,
)

CUBE = HPolyhedron.make_unit_box(3)
"""From -1 to 1 along each axis."""

BOX = np.array([[x, y, z] for x in (-0.2, 0.2) for y in (-0.3, 0.3) for z in (-0.4, 0.4)])
SHAPES = [
    (Sphere(0.2), 0.2),
    (Box(0.4, 0.6, 0.8), 0.2),
    (Convex(vertices=BOX), 0.2),
    (Ellipsoid(0.2, 0.3, 0.4), 0.2),
    (Capsule(0.2, 0.5), 0.2),
    (Cylinder(0.2, 0.5), 0.2),
]
"""Each reaches 0.2 along x."""


def scene(*placed):
    """Return a query of shapes on frames that are at some points, and the ids."""
    graph = SceneGraph()
    source = graph.register_source("s")
    context_poses, ids = {}, []
    for number, (shape, at) in enumerate(placed):
        frame = graph.register_frame(source, GeometryFrame(f"f{number}"))
        instance = GeometryInstance(np.eye(4), shape, f"g{number}")
        instance.set_proximity_properties(ProximityProperties())
        ids.append(graph.register_geometry(source, frame, instance))
        X = np.eye(4)
        X[:3, 3] = at
        context_poses[frame] = X
    context = graph.create_default_context()
    context.set_frame_poses(source, context_poses)
    return graph.query_object(context), ids


@pytest.mark.parametrize(("shape", "reach"), SHAPES, ids=lambda v: getattr(v, "type_name", ""))
@pytest.mark.parametrize("depth", [0.1, 1e-6])
def test_depths_and_points_are_those_of_construction(shape, reach, depth):
    """A shape that reaches 0.2 along x is that much in at x = 1, and free on the other side."""
    query, (inside, _) = scene(
        (shape, [1.0 + reach - depth, 0.1, -0.1]), (shape, [1.0 + reach + depth, 0.1, -0.1])
    )
    (cut,) = find_region_cuts(CUBE, query)
    assert cut.geometry_id == inside
    assert cut.depth == pytest.approx(depth, abs=1e-9)
    assert cut.is_proven
    assert CUBE.point_in_set(cut.point, 1e-12)
    nearest = query.compute_signed_distance_to_point(cut.point, 1.0)
    assert min(each.distance for each in nearest if each.id_G == inside) <= 1e-12


def test_the_nearest_face_tells_the_depth():
    """A ball that is in near an edge: by 0.05 at one face and 0.3 at the other."""
    query, _ = scene((Sphere(0.5), [1.45, 1.2, 0.0]))
    (cut,) = find_region_cuts(CUBE, query)
    assert cut.depth == pytest.approx(0.05, abs=1e-12)


def test_what_touches_reaches_into_it_by_nothing():
    """A box whose face is exactly that of the region, and one that is an ulp further away."""
    query, (touching, _) = scene(
        (Box(1.0, 1.0, 1.0), [1.5, 0.0, 0.0]),
        (Box(1.0, 1.0, 1.0), [-1.5 - 4.5e-16, 0.0, 0.0]),
    )
    (cut,) = find_region_cuts(CUBE, query)
    assert (cut.geometry_id, cut.depth, cut.is_proven) == (touching, 0.0, True)


def test_half_spaces_and_corners():
    """A floor below the region and one through it; a box that only its corner keeps out."""
    query, _ = scene((HalfSpace(), [0.0, 0.0, -1.01]))
    assert find_region_cuts(CUBE, query) == []
    query, _ = scene((HalfSpace(), [0.0, 0.0, -0.75]))
    (cut,) = find_region_cuts(CUBE, query)
    assert cut.depth == pytest.approx(0.25, abs=1e-12)
    # No face alone keeps this ball out: it is sqrt(2) * 0.21 - 0.25 from the edge.
    query, _ = scene((Sphere(0.25), [1.21, 1.21, 0.0]))
    assert find_region_cuts(CUBE, query) == []


def test_some_are_ignored_or_asked_about_alone():
    """By their ids."""
    query, ids = scene(*((Sphere(0.1), [x, 0.0, 0.0]) for x in (-0.5, 0.0, 0.5)))
    assert [cut.geometry_id for cut in find_region_cuts(CUBE, query)] == ids
    found = find_region_cuts(CUBE, query, ignored={ids[1]})
    assert [cut.geometry_id for cut in found] == [ids[0], ids[2]]
    found = find_region_cuts(CUBE, query, ignored={ids[0]}, among=ids[:2])
    assert [cut.geometry_id for cut in found] == [ids[1]]


def test_regions_are_free_where_they_grew_and_not_where_others_are():
    """Against distances to points of the region: nothing is nearer than what is told."""
    rng = np.random.default_rng(5)
    placed = []
    while len(placed) < 40:
        at = rng.uniform(-1.0, 1.0, 3)
        if np.linalg.norm(at) > 0.6:
            placed.append((SHAPES[len(placed) % len(SHAPES)][0], at))
    query, ids = scene(*placed)
    sets = [each.convex_set for each in scene_obstacles(query)]
    region = iris(sets, [0.0, 0.0, 0.0], CUBE)
    assert find_region_cuts(region, query) == []
    moved = HPolyhedron(region.A, region.b + 0.15 * np.linalg.norm(region.A, axis=1))
    told = {cut.geometry_id for cut in find_region_cuts(moved, query)}
    assert told
    assert told == {i for i, each in zip(ids, sets, strict=True) if moved.intersects_with(each)}


def test_empty_regions_are_free_and_unbounded_ones_refused():
    """And what is in another number of dimensions."""
    query, _ = scene((Sphere(0.1), [0.0, 0.0, 0.0]))
    nothing = CUBE.intersection(HPolyhedron([[1.0, 0.0, 0.0]], [-2.0]))
    assert find_region_cuts(nothing, query) == []
    for region, words in (
        (HPolyhedron([[1.0, 0.0, 0.0]], [0.0]), "unbounded"),
        (HPolyhedron.make_unit_box(2), "3 dimensions"),
        (VPolytope.make_unit_box(3), "must be an HPolyhedron"),
    ):
        with pytest.raises(ConvexSetError, match=words):
            find_region_cuts(region, query)
