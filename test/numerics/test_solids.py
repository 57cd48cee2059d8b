"""Solids of bodies against constructive truth, and real robots' meshes against winding numbers."""

from constructed_solids import boundary, distances, inside, random_solid, written
import numpy as np
import pytest
from robot_files import disagreements, robot_meshes
from searching import times

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.sources import load_surface, surface_of
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

POINTS = 200
"""Of each solid; half of them in its box, half within a tenth of its size from a face."""

SIDES, SIDES_FLOAT32 = 1e-9, 3e-6
"""Relative to the size: nearer to the surface a side may be either. Of coordinates in float32 the
faces of a body are bent, and those that touch are apart or overlap, by rounding."""

SLIVERS = 1e-9
"""Relative to the size: the promise where bodies meet in slivers, as they may anywhere here."""

PLAIN = 1e-11
"""The same for nine solids of ten."""


def asked_points(rng, solid):
    """Return points in and around a solid, and near its bodies' faces."""
    corners = np.vstack([body.vertices for body in solid.bodies])
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    spread = 0.1 * (upper - lower)
    middles = np.vstack([body.vertices[body.faces].mean(axis=1) for body in solid.bodies])
    near = middles[rng.integers(len(middles), size=POINTS // 2)]
    step = rng.normal(size=near.shape) * solid.size * 10.0 ** rng.uniform(-7, -1, (len(near), 1))
    return np.vstack([rng.uniform(lower - spread, upper + spread, near.shape), near + step])


def signed_distances(mesh, points):
    """Return the signed distances of (n, 3) points from a mesh."""
    table = build_shape_table([mesh], [True])
    return distance_points(table, np.eye(4)[None].copy(), points, np.inf)[2]


@pytest.mark.search
def test_random_solids_have_the_sides_and_distances_of_their_bodies():
    """Nested, touching, turned, small, hollow bodies in any order, way, layout and precision."""
    worst = []
    for seed in range(times(15)):
        rng = np.random.default_rng(seed)
        solid = random_solid(rng)
        single = rng.random() < 0.3
        vertices, faces = written(rng, solid, single=single)
        mesh = Mesh(vertices=vertices, faces=faces)
        report = surface_of(mesh).report
        assert report.is_closed, (seed, str(report))
        points = asked_points(rng, solid)
        phi = signed_distances(mesh, points)
        expected = distances(boundary(solid), points)
        clear = expected > (SIDES_FLOAT32 if single else SIDES) * solid.size
        wrong = ((phi < 0.0) != inside(solid, points)) & clear
        assert not wrong.any(), (seed, points[wrong][0], str(report))
        if not single:
            worst.append(np.abs(np.abs(phi) - expected).max() / solid.size)
            assert worst[-1] <= SLIVERS, (seed, worst[-1], str(report))
    assert np.quantile(worst, 0.9) <= PLAIN


FILES = robot_meshes()


@pytest.mark.search
@pytest.mark.skipif(not FILES, reason="example-robot-data is not installed")
def test_meshes_of_robots_have_the_sides_of_their_winding_numbers():
    """By solid angles of the file's own triangles, joined and oriented by other code than ours."""
    rng = np.random.default_rng(4)
    chosen = rng.permutation(len(FILES))[: min(times(4), len(FILES))]
    compared = 0
    for path in (FILES[i] for i in chosen):
        mesh = Mesh(path)
        try:
            vertices, triangles = load_surface(mesh)
            surface = surface_of(mesh)
        except MeshError:
            continue  # a file of the set has no vertices
        bad = disagreements(
            rng, surface, vertices, triangles, lambda q, mesh=mesh: signed_distances(mesh, q)
        )
        compared += bad is not None
        assert bad is None or not len(bad), (path, bad[0], str(surface.report))
    assert compared
