"""Solids of bodies against constructive truth."""

from constructed_solids import boundary, distances, inside, random_solid, written
from mesh_distances import signed_distances
import numpy as np
import pytest
from searching import times

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.sources import surface_of

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
