"""Regions among obstacles: proven free, as large as constructed, the same however it is said."""

from __future__ import annotations

import math

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
    Mesh,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    AffineSubspace,
    CartesianProduct,
    ConvexHull,
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    iris,
    IrisOptions,
    make_iris_obstacles,
    MinkowskiSum,
    Point,
    VPolytope,
)

GROW = IrisOptions(termination_threshold=-1.0)
"""To the end also where all is tiny."""

SQUARE = HPolyhedron.make_box([-1.0, -1.0], [1.0, 1.0])
SIZES = [1e-8, 1.0, 1e8]


def check(record, obstacles, sample, size=1.0, shift=0.0):
    """Check the proof of each obstacle, that faces touch what they keep out, and the sample."""
    assert [s.obstacle for s in record.separations] == list(range(len(obstacles)))
    reach = 0.0
    for separation in record.separations:
        certificate = separation.certificate
        assert certificate.kind == "farkas"
        assert certificate.verify()
        face = certificate.of[0]
        assert (face.A[0] == record.region.A[separation.row]).all()
        assert face.b[0] == record.region.b[separation.row]
        reach = max(reach, float(np.abs(face.b[0])))
    used = {s.row for s in record.separations}
    for row in used:
        behind = [s.obstacle for s in record.separations if s.row == row]
        normal, side = record.region.A[row], record.region.b[row]
        floors = [-obstacles[k].support(-normal).value for k in behind]
        assert min(floors) - side == pytest.approx(0.0, abs=1e-8 * size + 1e-11 * (reach + shift))
    assert len(record.region.b) == len(used) + 2 * len(sample)


def random_obstacles(rng, n, count):
    """Return obstacles of seven kinds about the origin, none of which holds it."""
    found = []
    for k in range(count):
        way = rng.normal(size=n)
        center = way / np.linalg.norm(way) * rng.uniform(0.35, 1.2)
        r = 0.3 * rng.uniform(0.2, 0.8)
        corners = center + r * rng.normal(size=(n + 2, n)) / math.sqrt(n + 2.0)
        kind = k % 7
        if kind == 0:
            found.append(VPolytope(corners))
        elif kind == 1:
            found.append(Hyperellipsoid.make_hypersphere(r, center))
        elif kind == 2:
            found.append(AffineBall(r * rng.uniform(-1, 1, size=(n, n)) / n, center))
        elif kind == 3:
            found.append(Hyperrectangle(center - r / n, center + 0.5 * r / n))
        elif kind == 4:
            ball = Hyperellipsoid.make_hypersphere(0.3 * r, np.zeros(n))
            found.append(MinkowskiSum(ball, VPolytope(corners[:2])))
        elif kind == 5:
            found.append(HPolyhedron(VPolytope(corners)))
        else:
            found.append(Point(center))
    origin = np.zeros(n)
    return [each for each in found if each.projection(origin[None]).distances[0] > 0.02]


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("seed", [0, 1])
def test_among_obstacles_of_all_kinds(n, seed):
    """Each is beyond its face, exactly; points of the region are in none of them."""
    rng = np.random.default_rng([n, seed])
    obstacles = random_obstacles(rng, n, 28)
    domain = HPolyhedron.make_box(-1.5 * np.ones(n), 1.5 * np.ones(n))
    record = iris(obstacles, np.zeros(n), domain, GROW, certificate=True)
    check(record, obstacles, np.zeros(n))
    assert record.reason == "converged"
    assert (np.diff(record.volumes[:-1]) > 0.0).all()
    inside = [record.region.uniform_sample(rng, mixing_steps=20) for _ in range(50)]
    for each in obstacles:
        assert not each.point_in_set(np.array(inside), 0.0).any()
    bounds = iris(obstacles, np.zeros(n), domain, GROW)
    assert (bounds.A == record.region.A).all() and (bounds.b == record.region.b).all()


@pytest.mark.parametrize("n", [2, 3])
def test_among_a_thousand_obstacles_of_several_kinds(n):
    """Each is beyond a face by formulas of this test; the seed stays inside on request."""
    rng = np.random.default_rng(n)
    obstacles, reaches = [], []
    while len(obstacles) < 1000:
        at, size = rng.uniform(-3.0, 3.0, n), rng.uniform(0.02, 0.08)
        if np.linalg.norm(at) < 0.3:
            continue
        kind = len(obstacles) % 4
        if kind == 0:
            obstacles.append(Hyperellipsoid.make_hypersphere(size, at))
            reaches.append(lambda A, p=at, r=size: A @ p - r * np.linalg.norm(A, axis=1))
            continue
        corners = at + size * rng.uniform(-1.0, 1.0, (n + 3, n))
        if kind == 1:
            obstacles.append(VPolytope(corners))
        elif kind == 2:
            corners = at + size * np.array(np.meshgrid(*[[-1.0, 1.0]] * n)).reshape(n, -1).T
            obstacles.append(Hyperrectangle(at - size, at + size))
        else:
            obstacles.append(MinkowskiSum([VPolytope(corners), Point(np.zeros(n))]))
        reaches.append(lambda A, v=corners: (A @ v.T).min(axis=1))
    domain = HPolyhedron.make_box(-3.0 * np.ones(n), 3.0 * np.ones(n))
    options = IrisOptions(require_sample_point_is_contained=True)
    region = iris(obstacles, np.zeros(n), domain, options)
    assert region.point_in_set(np.zeros(n), 0.0)
    for reach in reaches:
        assert (reach(region.A) >= region.b).any()
    # More than the ball that nothing is in.
    assert region.maximum_volume_inscribed_ellipsoid().calc_volume() > math.pi * 0.2**n


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_sizes_and_places_do_not_matter(size, shift):
    """A corner, a disc, a stick without width, a point and a floor without end, in a square."""
    at = np.full(2, shift * size)
    obstacles = [
        VPolytope(size * np.array([[0.3, 0.3], [1.0, 0.2], [1.0, 1.0]]) + at),
        Hyperellipsoid.make_hypersphere(0.3 * size, size * np.array([-0.5, 0.4]) + at),
        AffineBall(size * np.array([[0.5, 0.0], [0.0, 0.0]]), size * np.array([0.0, -0.5]) + at),
        Point(size * np.array([-0.6, -0.2]) + at),
        HPolyhedron([[0.0, 1.0]], [-0.9 * size + at[1]]),
    ]
    domain = HPolyhedron.make_box(-size + at, size + at)
    record = iris(obstacles, at, domain, GROW, certificate=True)
    assert record.volumes[-1] / size**2 == pytest.approx(0.97875, abs=1e-4)
    assert all(s.certificate.verify() for s in record.separations)
    assert len(record.separations) == 5
    assert record.region.point_in_set(at, 0.0)


def test_beside_a_wall_the_region_is_what_is_left():
    """A wall from x = 1/2 on, of any kind: the largest ellipse has axes 3/4 and 1."""
    walls = [
        HPolyhedron([[-1.0, 0.0]], [-0.5]),
        VPolytope.make_box([0.5, -2.0], [1.0, 2.0]),
        Hyperrectangle([0.5, -2.0], [0.6, 2.0]),
        AffineSubspace([[0.0], [1.0]], [0.5, 0.0]),
        Intersection([HPolyhedron([[-1.0, 0.0]], [-0.5]), SQUARE]),
        CartesianProduct([VPolytope([[0.5], [0.7]]), Hyperellipsoid([[0.2]], [0.0])]),
        ConvexHull([Point([0.5, -3.0]), Point([0.5, 3.0])]),
    ]
    for wall in walls:
        record = iris([wall], [0.0, 0.0], SQUARE, certificate=True)
        assert record.volumes[-1] == pytest.approx(0.75 * math.pi, abs=1e-8)
        assert record.separations[0].certificate.verify()
        assert record.region.contained_in(HPolyhedron([[1.0, 0.0]], [0.5]), 0.0)
        assert record.region.point_in_set([0.5 - 1e-9, 0.99], 1e-12)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-11])
def test_between_walls_that_nearly_touch(gap):
    """The ellipse between them has half their distance as one axis, less what faces move in."""
    walls = [
        VPolytope.make_box([-1.0, 0.5 * gap], [1.0, 1.0]),
        VPolytope.make_box([-1.0, -1.0], [1.0, -0.5 * gap]),
    ]
    record = iris(walls, [0.0, 0.0], SQUARE, GROW, certificate=True)
    assert record.volumes[-1] == pytest.approx(0.5 * math.pi * gap, abs=4e-12 * math.pi)
    assert all(s.certificate.verify() for s in record.separations)


def test_nothing_in_the_way_leaves_the_domain():
    """No obstacles, or only empty ones."""
    nothing = [VPolytope(np.zeros((0, 2))), HPolyhedron([[1.0, 0.0], [-1.0, 0.0]], [0.0, -1.0])]
    for obstacles in ([], nothing):
        record = iris(obstacles, [0.5, 0.0], SQUARE, certificate=True)
        assert (record.region.A == SQUARE.A).all()
        assert record.separations == ()
        assert record.volumes[-1] == pytest.approx(math.pi)


def test_no_dimensions():
    """One point, which is free."""
    domain = HPolyhedron(np.zeros((0, 0)), [])
    assert iris([], [], domain).ambient_dimension == 0


def test_options():
    """Each ends growing as it says, and the record says so."""
    rng = np.random.default_rng(4)
    obstacles = random_obstacles(rng, 2, 21)
    whole = iris(obstacles, [0.0, 0.0], SQUARE, GROW, certificate=True)
    assert len(whole.volumes) > 2
    once = iris(obstacles, [0.0, 0.0], SQUARE, IrisOptions(iteration_limit=1), certificate=True)
    assert (once.reason, len(once.volumes)) == ("iterations", 1)
    assert once.volumes[0] == whole.volumes[0]
    asked = []
    stop = IrisOptions(
        termination_func=lambda region: asked.append(region) or len(asked) == 2,
        termination_threshold=-1.0,
    )
    stopped = iris(obstacles, [0.0, 0.0], SQUARE, stop, certificate=True)
    assert stopped.reason == "termination_func"
    assert stopped.region is asked[0]
    with pytest.raises(ConvexSetError, match="termination_func is true of the first region"):
        iris(obstacles, [0.0, 0.0], SQUARE, IrisOptions(termination_func=lambda region: True))
    small = IrisOptions(bounding_region=HPolyhedron.make_box([-0.2, -0.2], [0.2, 0.3]))
    inside = iris(obstacles, [0.0, 0.0], SQUARE, small)
    assert inside.contained_in(small.bounding_region, 0.0)
    start = IrisOptions(starting_ellipse=whole.ellipsoid, iteration_limit=1)
    again = iris(obstacles, [0.0, 0.0], SQUARE, start, certificate=True)
    assert again.volumes[0] >= whole.volumes[-1] * (1.0 - 1e-6)
    unasked = IrisOptions(verify_domain_boundedness=False, termination_threshold=-1.0)
    assert (iris(obstacles, [0.0, 0.0], SQUARE, unasked).b == whole.region.b).all()


def test_the_sample_is_kept_on_request():
    """Over the tip of a wall, near its narrow side: regions grow into the open on the other."""
    wall = [VPolytope([[0.0, -1.0], [0.0, 0.0]])]
    domain, sample = HPolyhedron.make_box([-1.0, -1.0], [0.1, 0.2]), [0.05, 0.1]
    away = iris(wall, sample, domain, GROW, certificate=True)
    assert not away.region.point_in_set(sample, 0.0)
    # What is left of the wall, all of it: 1 by 1.2.
    assert away.volumes[-1] == pytest.approx(0.25 * math.pi * 1.2, abs=1e-3)
    keep = IrisOptions(require_sample_point_is_contained=True, termination_threshold=-1.0)
    kept = iris(wall, sample, domain, keep, certificate=True)
    assert kept.reason == "sample"
    assert kept.region.point_in_set(sample, 0.0)
    assert kept.separations[0].certificate.verify()
    assert 0.0 < kept.volumes[-1] < away.volumes[-1]


SHAPES = [
    (Sphere(0.2), (0.6, 0.0, 0.1)),
    (Sphere(0.0), (-0.3, -0.3, 0.6)),
    (Ellipsoid(0.1, 0.2, 0.3), (-0.6, 0.1, 0.0)),
    (Box(0.2, 0.3, 0.4), (0.0, 0.6, 0.0)),
    (Capsule(0.1, 0.4), (0.0, -0.6, 0.1)),
    (Cylinder(0.15, 0.3), (0.1, 0.1, 0.7)),
    (Convex(vertices=[[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.3]]), (-0.6, -0.7, -0.4)),
    (
        Mesh(
            vertices=[[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0], [0, 0, 0.3], [0.05, 0.05, 0.05]],
            faces=[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]],
        ),
        (0.5, 0.5, 0.5),
    ),
    (HalfSpace(), (0.0, 0.0, -0.8)),
]
"""Every kind of shape, one mesh with a dent, and where they are."""


def scene():
    """Return a query of all shapes and a frame that is turned and moved."""
    graph = SceneGraph()
    source = graph.register_source("room")
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    for k, (shape, place) in enumerate(SHAPES):
        pose = np.eye(4)
        pose[:3, 3] = place
        if not isinstance(shape, HalfSpace):
            pose[:3, :3] = turn
        instance = GeometryInstance(pose, shape, f"thing {k}")
        geometry_id = graph.register_anchored_geometry(source, instance)
        graph.assign_role(source, geometry_id, ProximityProperties())
    return graph.query_object(graph.create_default_context())


def test_the_shapes_of_a_scene():
    """Sets are the shapes to rounding, by the point query; the region is free of all."""
    query, rng = scene(), np.random.default_rng(7)
    obstacles = make_iris_obstacles(query)
    assert len(obstacles) == len(SHAPES)
    domain = HPolyhedron.make_box([-1.0] * 3, [1.0] * 3)
    record = iris(obstacles, [0.0, 0.0, 0.0], domain, GROW, certificate=True)
    check(record, obstacles, np.zeros(3))
    points = rng.uniform(-1.0, 1.0, size=(300, 3))
    table = query.compute_signed_distance_to_points(points)
    ids = query.inspector().get_all_geometry_ids()
    for geometry_id, each in zip(ids, obstacles, strict=True):
        if isinstance(query.inspector().get_shape(geometry_id), Mesh):
            continue
        rows = table.id_G == int(geometry_id)
        outside = table.distance[rows] > 0.0
        found = each.projection(points).distances
        np.testing.assert_allclose(found, np.maximum(table.distance[rows], 0.0), atol=2e-8)
        assert outside.any()
    inside = np.array([record.region.uniform_sample(rng, mixing_steps=20) for _ in range(100)])
    assert query.compute_signed_distance_to_points(inside).distance.min() > 0.0


def test_the_shapes_of_a_scene_in_a_frame():
    """As seen from a frame on its way, all are moved the other way."""
    graph = SceneGraph()
    source = graph.register_source("arm")
    frame = graph.register_frame(source, GeometryFrame("hand"))
    pose = np.eye(4)
    pose[:3, 3] = [1.0, 2.0, 3.0]
    ball = graph.register_anchored_geometry(source, GeometryInstance(pose, Sphere(0.5), "ball"))
    graph.assign_role(source, ball, ProximityProperties())
    context = graph.create_default_context()
    X_WF = np.array([[0.0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    context.set_frame_poses(source, X_WF[None])
    (found,) = make_iris_obstacles(graph.query_object(context), frame)
    np.testing.assert_allclose(found.center, [2.0, 4.0, 3.0], atol=1e-15)
    with pytest.raises(UnknownIdError):
        make_iris_obstacles(graph.query_object(context), FrameId(10**6))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ([Point([0.0, 0.0])], [0.0, 0.0], SQUARE),
            r"sample \[0.0, 0.0\] is in or at obstacles\[0\]",
        ),
        (
            ([VPolytope.make_box([-1, 0], [1, 1])], [0.0, 0.5], SQUARE),
            r"obstacles\[0\] \(VPolytope\)",
        ),
        (([], [2.0, 0.0], SQUARE), r"outside the domain by 1"),
        (([], [0.0, 0.0, 0.0], SQUARE), "sample"),
        (([], [math.nan, 0.0], SQUARE), "sample"),
        (
            ([Point([0.0])], [0.0, 0.0], SQUARE),
            r"obstacles\[0\] has 1 dimensions, the domain has 2",
        ),
        ((["wall"], [0.0, 0.0], SQUARE), r"obstacles\[0\] must be a ConvexSet, not 'wall'"),
        (([], [0.0, 0.0], HPolyhedron([[1.0, 0.0]], [1.0])), "domain is unbounded"),
        (
            (
                [],
                [0.0],
                HPolyhedron.make_box([1.0], [2.0]).intersection(HPolyhedron([[1.0]], [0.0])),
            ),
            "domain is empty",
        ),
        (([], [0.0, 0.0], Hyperrectangle([0, 0], [1, 1])), "domain must be an HPolyhedron"),
        (
            ([], [0.0, 0.0], SQUARE, IrisOptions(starting_ellipse=Hyperellipsoid([[1.0]], [0.0]))),
            "starting_ellipse must be a Hyperellipsoid in 2 dimensions",
        ),
    ],
)
def test_what_is_wrong_is_named(arguments, message):
    """The argument and its value."""
    with pytest.raises(ConvexSetError, match=message):
        iris(*arguments)


@pytest.mark.parametrize(
    "options",
    [
        {"iteration_limit": 0},
        {"iteration_limit": 2.5},
        {"termination_threshold": math.nan},
        {"relative_termination_threshold": "small"},
        {"termination_func": 3},
    ],
)
def test_options_that_can_not_be_are_named(options):
    """By name and value."""
    (name,) = options
    with pytest.raises(ConvexSetError, match=f"IrisOptions: {name} must be"):
        IrisOptions(**options)
