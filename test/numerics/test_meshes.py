"""Meshes that are no clean solids: repaired, answered by the rule in docs/meshes.md, refused."""

from hard_corpus.batches import Case, solve
from hard_corpus.bodies import closed_mesh, dented_mesh
from hard_corpus.constructed import random_pose
from hard_corpus.sites import pose
import numpy as np
import pytest

from scene_graph_ros.geometry import Capsule, Mesh, Sphere
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

DENTED = dented_mesh(0.2, 24)
POINTS, FACES = np.asarray(DENTED.vertices), np.asarray(DENTED.faces)
QUERIES = np.random.default_rng(1).uniform(-0.15, 0.15, (300, 3))


def nearest_of_triangles(mesh, q):
    """Return the distance of q from the nearest of all triangles, one by one.

    Inside the three planes through its sides it is the height over the triangle, else the least
    distance from a side.
    """
    a, b, c = (np.asarray(mesh.vertices)[np.asarray(mesh.faces)[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    size = np.linalg.norm(n, axis=1)
    a, b, c, n = (x[size > 0.0] for x in (a, b, c, n))
    n = n / np.linalg.norm(n, axis=1)[:, None]
    within = np.ones(len(a), bool)
    best = np.full(len(a), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        within &= np.einsum("ij,ij->i", np.cross(side, q - start), n) >= 0.0
        t = np.einsum("ij,ij->i", q - start, side) / np.einsum("ij,ij->i", side, side)
        nearest = start + np.clip(t, 0.0, 1.0)[:, None] * side
        best = np.minimum(best, np.linalg.norm(q - nearest, axis=1))
    height = abs(np.einsum("ij,ij->i", q - a, n))
    return np.where(within, height, best).min()


def point_distances(mesh):
    """Return the signed distances of QUERIES."""
    table = build_shape_table([mesh], [True])
    _, _, phi, *_ = distance_points(table, np.eye(4)[None].copy(), QUERIES, np.inf)
    return phi


def ball_distances(mesh):
    """Return the signed distances of small balls at QUERIES, and of capsules."""
    cases = []
    for k, q in enumerate(QUERIES):
        B = Sphere(0.01) if k % 2 else Capsule(0.01, 0.03)
        cases.append(Case(str(k), mesh, B, np.eye(4), pose(np.eye(3), q), np.nan, (True, False)))
    return solve(cases).distance


def _unclean():
    """Return the dented mesh with faults that are repaired."""
    soup = Mesh(
        vertices=POINTS[FACES].reshape(-1, 3), faces=np.arange(3 * len(FACES)).reshape(-1, 3)
    )
    doubled = Mesh(vertices=POINTS, faces=np.vstack([FACES, FACES[::3]]))
    flat = [[0, 0, 1], [2, 2, 2], [3, 4, 3]]
    without_area = Mesh(vertices=POINTS, faces=np.vstack([FACES, flat]))
    rng = np.random.default_rng(2)
    unused = Mesh(vertices=np.vstack([POINTS, rng.normal(size=(9, 3))]), faces=FACES)
    turned = Mesh(vertices=POINTS, faces=FACES[:, ::-1])
    shuffled = Mesh(vertices=POINTS, faces=rng.permutation(np.roll(FACES, 1, axis=1)))
    return {
        "soup": soup,
        "doubled": doubled,
        "without area": without_area,
        "unused vertices": unused,
        "inside out": turned,
        "shuffled": shuffled,
    }


@pytest.mark.parametrize("name", list(_unclean()))
def test_repaired_meshes_answer_like_the_clean_one(name):
    """Soups, doubled and zero-area triangles, unused vertices, inverted: as if they were clean."""
    mesh = _unclean()[name]
    assert np.abs(point_distances(mesh) - point_distances(DENTED)).max() <= 1e-15
    apart = ball_distances(DENTED) > 0.0
    assert 20 < np.count_nonzero(apart) < len(apart)
    difference = np.abs(ball_distances(mesh) - ball_distances(DENTED))
    assert difference[apart].max() <= 1e-15
    # Overlaps, too: the rule does not depend on the order of the triangles.
    assert difference.max() <= 1e-15


def test_closed_mesh_is_as_far_as_its_nearest_triangle():
    """By brute force over all triangles; negative exactly inside, which parity decides."""
    phi = point_distances(DENTED)
    expected = [nearest_of_triangles(DENTED, q) for q in QUERIES]
    assert np.abs(np.abs(phi) - expected).max() <= 1e-12 * 0.2
    assert np.array_equal(phi < 0.0, [_winding(DENTED, q) > 0.5 for q in QUERIES])


def _winding(mesh, q):
    """Return the share of the sphere around q that the mesh covers (van Oosterom, Strackee)."""
    a, b, c = (np.asarray(mesh.vertices)[np.asarray(mesh.faces)[:, k]] - q for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + np.einsum("ij,ij->i", a, b) * lc
    below += np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
    return np.sum(2.0 * np.arctan2(triple, below)) / (4.0 * np.pi)


def _without_inside():
    """Return meshes that bound nothing."""
    return {
        "open": Mesh(vertices=POINTS, faces=FACES[3:]),
        "one triangle": Mesh(vertices=POINTS[:3], faces=[[0, 1, 2]]),
    }


@pytest.mark.parametrize("name", list(_without_inside()))
def test_meshes_without_an_inside_are_surfaces_with_two_sides(name):
    """Their distance from a point is that of the nearest triangle and nowhere negative."""
    mesh = _without_inside()[name]
    phi = point_distances(mesh)
    expected = [nearest_of_triangles(mesh, q) for q in QUERIES]
    assert np.abs(phi - expected).max() <= 1e-12 * 0.4
    # A ball that does not cut them is apart, wherever its centre is.
    balls = ball_distances(mesh)[1::2]
    free = np.array(expected[1::2]) > 0.01
    assert np.abs(balls - (np.array(expected[1::2]) - 0.01))[free].max() <= 1e-12 * 0.4


@pytest.mark.parametrize(
    ("vertices", "faces", "reason"),
    [
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], "no triangle with an area"),
        ([[0, 0, 0], [0, 0, 0], [1, 0, 0]], [[0, 1, 2]], "no triangle with an area"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]], "3"),
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], "finite"),
    ],
)
def test_what_is_no_surface_is_refused(vertices, faces, reason):
    """Without any area, with indices of nothing or coordinates that are no numbers: MeshError."""
    with pytest.raises((MeshError, ValueError), match=reason):
        build_shape_table([Mesh(vertices=vertices, faces=faces)], [True])


def test_convex_mesh_by_triangles_is_its_hull():
    """A convex mesh gives the same distances by triangles as by its hull, also overlapping."""
    mesh = closed_mesh(0.2, 24)
    rng = np.random.default_rng(4)
    cases = []
    for k in range(200):
        X_WB = random_pose(rng, 0.12)
        B = (Sphere(0.03), Capsule(0.02, 0.1), mesh)[k % 3]
        cases.append(Case(str(k), mesh, B, np.eye(4), X_WB))
    by_triangles = solve([case._replace(triangles=(True, False)) for case in cases])
    by_hull = solve(cases)
    apart = by_hull.distance > 0.0
    assert 20 < np.count_nonzero(apart) < 180
    difference = np.abs(by_triangles.distance - by_hull.distance)
    assert difference[apart].max() <= 1e-12 * 0.2
    assert np.array_equal(by_triangles.distance < 0.0, by_hull.distance < 0.0)
