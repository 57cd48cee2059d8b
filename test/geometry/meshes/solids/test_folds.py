"""Surfaces that lie on themselves: what is between their sides is nothing, what is beside is."""

from mesh_distances import signed_distances
import numpy as np
import pytest
from winding_truth import solid_angles

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.sources import surface_of

# A prism over an L, from z=0 to z=1; its hollow corner is 3.
L = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
WALLS = [(k, (k + 1) % 6, (k + 1) % 6 + 6) for k in range(6)]
WALLS += [(k, (k + 1) % 6 + 6, k + 6) for k in range(6)]
FLOOR = [(0, 2, 1), (0, 3, 2), (0, 4, 3), (0, 5, 4)]
# A fan from corner 1: its triangle (1, 3, 4) is turned over, and lies on (1, 4, 5) and on nothing.
TOP = [(7, 8, 9), (7, 9, 10), (7, 10, 11), (7, 11, 6)]


BOX = [(x, y, z) for x in (-1, 3) for y in (-1, 3) for z in (-1, 3)]
SIDES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
SIDES += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]


@pytest.mark.parametrize("is_cavity", [False, True])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_beside_a_fold_sides_are_those_of_winding_numbers(angle, is_cavity):
    """A lid that is cut into triangles from a corner that does not see all others.

    Of a solid the fold is outside, of a cavity inside.
    """
    corners = np.vstack([np.column_stack([L, np.full(6, z)]) for z in (0.0, 1.0)])
    faces = np.array(WALLS + FLOOR + TOP)
    if is_cavity:
        corners = np.vstack([corners, BOX])
        faces = np.vstack([faces[:, ::-1], np.array(SIDES) + 12])
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    axes = axes @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    vertices = corners @ axes.T
    near = np.random.default_rng(3).uniform((0, 0, 0.7), (2, 2, 1.3), (400, 3)) @ axes.T
    mesh = Mesh(vertices=vertices, faces=faces)
    report = surface_of(mesh).report
    assert (report.is_closed, report.reason) == (True, "")
    assert report.cavities == is_cavity
    wanted = solid_angles(near, vertices, faces) > 0.5
    phi = signed_distances(mesh, near)
    clear = np.abs(phi) > 1e-9
    np.testing.assert_array_equal((phi < 0.0)[clear], wanted[clear])
    assert clear.mean() > 0.95
