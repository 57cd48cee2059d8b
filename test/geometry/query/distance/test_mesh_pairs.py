"""Meshes measured by their triangles: against every shape, and against each other."""

from hypothesis import given, settings
from hypothesis import strategies as st
from measuring import box_vertices, measure, measure_both_ways, polytope_distance, pose
import numpy as np
import pytest
from searching import times
import trimesh

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

BY_TRIANGLES = (False, True)
BOTH = (True, True)


def mesh_of(surface):
    """Return the Mesh of a trimesh surface."""
    return Mesh(vertices=np.array(surface.vertices), faces=np.array(surface.faces))


def stairs():
    """Return a closed L: the cube [0, 2]^3 without the part where x > 1 and z > 1."""
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
    front = np.c_[outline[:, 0], np.zeros(6), outline[:, 1]]
    vertices = np.r_[front, front + np.array([0.0, 2.0, 0.0])]
    cap = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
    faces = [*cap, *[(c + 6, b + 6, a + 6) for a, b, c in cap]]
    sides = [(k, (k + 1) % 6) for k in range(6)]
    faces += [t for a, b in sides for t in ((b, a, a + 6), (b, a + 6, b + 6))]
    return Mesh(vertices=vertices, faces=np.array(faces))


SHAPES = [
    Sphere(0.2),
    Capsule(0.1, 0.3),
    Box(0.2, 0.3, 0.4),
    Cylinder(0.1, 0.4),
    Ellipsoid(0.1, 0.2, 0.15),
    Convex(vertices=np.random.default_rng(3).normal(size=(9, 3)) / 5),
]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(SHAPES))
def test_triangles_of_a_convex_mesh_are_its_hull(seed, shape):
    """Against a convex mesh, triangles and hull agree: apart, touching, deep and inside."""
    rng = np.random.default_rng(seed)
    mesh = mesh_of(trimesh.creation.icosphere(1, radius=0.5))
    X_WA = pose(rng.normal(size=3), rng.normal(size=3))
    X_WB = X_WA @ pose(rng.normal(size=3) * rng.choice([0.02, 0.2, 0.5]), rng.normal(size=3))
    triangles = measure_both_ways(shape, mesh, X_WA, X_WB, triangles=BY_TRIANGLES)
    hull = measure(shape, mesh, X_WA, X_WB)
    tolerance = 2e-9 if isinstance(shape, Cylinder | Ellipsoid) else 2e-14
    assert triangles.distance == pytest.approx(hull.distance, abs=tolerance)


WEDGE = Convex(vertices=np.array([(0, 0, -0.2), (0.1, 0, 0.1), (0, 0.1, 0.1), (-0.1, -0.1, 0.1)]))
SPIKE = Convex(vertices=np.array([(0.1, 0, 0), (-0.05, 0.1, 0), (-0.05, -0.1, 0), (0, 0, 0.1)]))

# Every shape's reach below its centre, standing upright, is known.
STANDING = [
    (Sphere(0.2), 0.2),
    (Capsule(0.1, 0.3), 0.25),
    (Box(0.2, 0.3, 0.4), 0.2),
    (Cylinder(0.1, 0.4), 0.2),
    (Ellipsoid(0.1, 0.2, 0.15), 0.15),
    (WEDGE, 0.2),
    (mesh_of(trimesh.creation.box((0.2, 0.2, 0.3))), 0.15),
]


@pytest.mark.parametrize("gap", [-0.05, -0.002, 0.002, 0.3])
@pytest.mark.parametrize(("shape", "reach"), STANDING)
def test_on_the_lower_step(shape, reach, gap):
    """A shape above the lower step of stairs, inside their hull, is its gap from the step."""
    X_WM = pose((0.2, -1 / 3, 0.4), (0.3, 0.7, -0.2))
    X_WS = X_WM @ pose((1.55, 1.1, 1 + reach + gap))
    triangles = (isinstance(shape, Mesh), True)
    pair = measure_both_ways(shape, stairs(), X_WS, X_WM, triangles=triangles)
    assert pair.distance == pytest.approx(gap, abs=2e-9)
    np.testing.assert_allclose(pair.nhat_BA_W, X_WM[:3, 2], atol=1e-6)
    assert measure(shape, stairs(), X_WS, X_WM).distance < -0.1  # by the hull: well inside


@pytest.mark.parametrize(
    ("shape", "reach"),
    [
        (Sphere(0.1), 0.1),
        (Capsule(0.1, 0.3), 0.1),
        (Box(0.2, 0.3, 0.4), 0.1),
        (Cylinder(0.1, 0.4), 0.1),
        (Ellipsoid(0.1, 0.2, 0.15), 0.1),
        (SPIKE, 0.05),
        (mesh_of(trimesh.creation.box((0.2, 0.2, 0.3))), 0.1),
    ],
)
def test_hidden_in_the_lower_step(shape, reach):
    """A shape wholly inside, 0.15 from a face, leaves by that and its reach against the normal."""
    X_WM = pose((0.2, -1 / 3, 0.4), (0.3, 0.7, -0.2))
    X_WS = X_WM @ pose((1.85, 1.0, 0.5))
    triangles = (isinstance(shape, Mesh), True)
    pair = measure_both_ways(shape, stairs(), X_WS, X_WM, triangles=triangles)
    assert pair.distance == pytest.approx(-0.15 - reach, abs=2e-9)
    np.testing.assert_allclose(pair.nhat_BA_W, X_WM[:3, 0], atol=1e-6)


def test_half_space_takes_the_deepest_vertex():
    """Stairs that sink into a plane are as deep as their lowest vertex, which is the witness."""
    X_WM = pose((0, 0, -0.1), (0.2, 0.1, 0.0))
    vertices = np.array(stairs().vertices) @ X_WM[:3, :3].T + X_WM[:3, 3]
    lowest = vertices[vertices[:, 2].argmin()]
    pair = measure_both_ways(HalfSpace(), stairs(), pose(), X_WM, triangles=BY_TRIANGLES)
    assert pair.distance == pytest.approx(lowest[2], abs=1e-15)
    np.testing.assert_allclose(pair.p_WCb, lowest, atol=1e-15)


@pytest.mark.search
@settings(max_examples=times(10), deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_two_bumpy_meshes_apart(seed):
    """Two bumpy meshes apart are as near as the nearest of all pairs of triangles."""
    rng = np.random.default_rng(seed)
    surface = trimesh.creation.icosphere(1, radius=1.0)
    faces = np.array(surface.faces)
    first = np.array(surface.vertices) * rng.uniform(0.6, 1.0, (42, 1))
    second = np.array(surface.vertices) * rng.uniform(0.6, 1.0, (42, 1))
    X_WB = pose(np.array([2.1, 0.3, -0.2]) * rng.choice([1.0, -1.0]), rng.normal(size=3))
    pair = measure_both_ways(
        Mesh(vertices=first, faces=faces),
        Mesh(vertices=second, faces=faces),
        pose(),
        X_WB,
        triangles=BOTH,
    )
    moved = second @ X_WB[:3, :3].T + X_WB[:3, 3]
    assert pair.distance == pytest.approx(_nearest(first[faces], moved[faces]), abs=1e-13)


@pytest.mark.search
@settings(max_examples=times(20), deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([0.02, 0.3, 3.0]))
def test_a_hull_beside_a_bumpy_mesh(seed, is_flat, gap):
    """A hull is as far from a mesh as from the nearest of all triangles, from any side.

    Also where many of them are as near: facets of a box that are cut into triangles, turned alike.
    """
    rng = np.random.default_rng(seed)
    surface = trimesh.creation.box((2.0, 2.0, 2.0)) if is_flat else trimesh.creation.icosphere(1)
    surface = surface.subdivide() if is_flat else surface
    bumps = 1.0 if is_flat else rng.uniform(0.6, 1.0, (len(surface.vertices), 1))
    mesh = Mesh(vertices=np.array(surface.vertices) * bumps, faces=np.array(surface.faces))
    corners = rng.uniform(-0.5, 0.5, (40, 3))
    if is_flat:
        corners = box_vertices(rng.uniform(0.2, 1.0, 3), np.eye(4))
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    X_WC = pose((1.0 + gap) * way + 0.5 * np.sign(way), np.zeros(3) if is_flat else way)
    pair = measure_both_ways(Convex(vertices=corners), mesh, X_WC, pose(), triangles=BY_TRIANGLES)
    moved = corners @ X_WC[:3, :3].T + X_WC[:3, 3]
    triangles = np.array(mesh.vertices)[np.array(mesh.faces)]
    truth = _nearest(moved[np.newaxis], triangles)
    if truth > 1e-6:
        assert pair.distance == pytest.approx(truth, abs=1e-13)
        np.testing.assert_allclose(pair.p_WCa - pair.p_WCb, truth * pair.nhat_BA_W, atol=1e-13)
    else:
        assert pair.distance <= 1e-6


def _nearest(first, second):
    """Return the least distance of two (n, 3, 3) sets of triangles, the promising pairs first."""
    centres, others = first.mean(axis=1), second.mean(axis=1)
    radii = np.linalg.norm(first - centres[:, None], axis=2).max(axis=1)
    other_radii = np.linalg.norm(second - others[:, None], axis=2).max(axis=1)
    bounds = np.linalg.norm(centres[:, None] - others, axis=2) - radii[:, None] - other_radii
    best = np.inf
    for k in np.argsort(bounds, axis=None):
        i, j = np.unravel_index(k, bounds.shape)
        if bounds[i, j] >= best:
            break
        best = min(best, polytope_distance(first[i], second[j]))
    return best


def test_crossing_plates():
    """Crossing plates, no vertex inside the other, overlap, no deeper than their hulls."""
    plate = mesh_of(trimesh.creation.box((1.0, 1.0, 0.02)))
    pair = measure_both_ways(plate, plate, pose(), pose((0, 0.3, 0), (1.2, 0, 0)), triangles=BOTH)
    hull = measure(plate, plate, pose(), pose((0, 0.3, 0), (1.2, 0, 0)))
    assert hull.distance <= pair.distance < -1e-3


def test_open_mesh_has_two_sides():
    """A ball leaves an open square to the side of its centre, on either side."""
    square = Mesh(
        vertices=np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float),
        faces=np.array([(0, 1, 2), (0, 2, 3)]),
    )
    for shape in (Sphere(0.1), Box(0.2, 0.2, 0.2)):
        for side in (1.0, -1.0):
            X_WS = pose((0.6, 0.3, side * 0.07))
            pair = measure_both_ways(shape, square, X_WS, pose(), triangles=BY_TRIANGLES)
            assert pair.distance == pytest.approx(-0.03, abs=1e-14)
            np.testing.assert_allclose(pair.nhat_BA_W, (0, 0, side), atol=1e-14)


@pytest.mark.parametrize("shape", [*SHAPES, stairs()])
def test_max_distance_never_hides_an_overlap(shape):
    """What overlaps is found with a maximal distance of 0, and what is near with its distance."""
    triangles = (isinstance(shape, Mesh), True)
    for p in ((1.7, 1.0, 0.5), (1.5, 1.0, 1.05), (3.0, 1.0, 0.5)):
        X_WS = pose(p, (0.1, 0.2, 0.3))
        free = measure(shape, stairs(), X_WS, pose(), triangles=triangles)
        limit = max(free.distance * 1.001, 0.0)
        bound = measure(shape, stairs(), X_WS, pose(), triangles=triangles, max_distance=limit)
        assert bound.distance == pytest.approx(free.distance, abs=1e-9)
