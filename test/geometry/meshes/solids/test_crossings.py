"""Surfaces that cross themselves along edges, where no edge goes through a triangle."""

from mesh_distances import signed_distances
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from winding_truth import solid_angles

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.sources import surface_of

# Corners of rings in the order in which they are joined, and apexes above and below them.
RINGS = {
    # Triangles have an apex in common and cross from there to where two sides of the ring do.
    "five sides that cross": ([(0, 2, 0), (3, 0, 0), (3, 4, 0), (0, 1, 0), (4, 3, 0)], (1.9, 2.1)),
    "sides that cross at one point": (
        [(0, 0, 0), (4, 2, 0), (0, 1, 0), (4, 0, 0), (2, 4, 0)],
        (2.2, 0.9),
    ),
    # An edge from each apex to a corner lies in triangles on the plane y=1.
    "an edge in triangles": (
        [(4, 1, 0), (3, -1, 0), (3, 1, 0), (1, 2, 1), (2, 1, 0)],
        (3.0, 1.0),
    ),
}


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.3, -0.8, 0.5)])
@pytest.mark.parametrize("name", RINGS)
@pytest.mark.parametrize("is_alone", [True, False])
def test_a_surface_that_crosses_itself_along_edges_is_cut(name, turn, is_alone):
    """Alone, or beside a body that it touches: sides are those of the winding numbers."""
    ring, middle = RINGS[name]
    n, R = len(ring), Rotation.from_rotvec(turn).as_matrix()
    k = np.arange(n)
    vertices = np.array([*ring, (*middle, 3), (*middle, -3)], dtype=float)
    j = (k + 1) % n
    faces = np.vstack([np.stack([k, j, 0 * k + n], 1), np.stack([j, k, 0 * k + n + 1], 1)])
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:
        faces = faces[:, ::-1]
    if not is_alone:
        box = [(x, y, z) for x in (1, 3) for y in (1, 3) for z in (3, 4)]
        sides = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
        sides += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
        faces = np.vstack([faces, np.array(sides) + len(vertices)])
        vertices = np.vstack([vertices, box])
    vertices = vertices @ R.T
    mesh = Mesh(vertices=vertices, faces=faces)
    report = surface_of(mesh).report
    assert (report.is_closed, report.parts) == (True, 2 - is_alone), str(report)
    assert any(r.kind == "bodies cut where they cross themselves" for r in report.repairs)
    rng = np.random.default_rng(4)
    points = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (1500, 3))
    winding = solid_angles(points, vertices, faces)
    assert winding.min() < -0.5 or winding.max() > 1.5
    phi = signed_distances(mesh, points)
    clear = np.abs(phi) > 1e-9
    np.testing.assert_array_equal((phi < 0.0)[clear], (winding > 0.5)[clear])
