"""Surfaces that lie on themselves: what is between their sides is nothing, what is beside is."""

import itertools

from constructed_solids import (
    boundary,
    convex_body,
    distances,
    inside,
    moved,
    rotation,
    solid_of_bodies,
)
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


def folded_beside_a_body(rng, fold):
    """Return vertices, triangles and truth of a prism that is folded, and of a box on the fold.

    A block on x < 0 has a flap in front of it that bends down from its top and lies on it, or a
    fin without thickness above it. The box touches the block, or the fin, on x = 0.
    """
    end, width, height = rng.uniform(0.5, 1.5, 3)
    corners = [(-1, 0), (0, 0), (0, 2)]
    if fold == "flap":
        corners += [(0, end), (width, end), (width, 3), (-1, 3)]
        floor = [(0, 1, 6), (1, 2, 6), (2, 3, 4), (2, 4, 5), (2, 5, 6)]
        solid = [((-1, 0), (0, 2)), ((-1, 2), (width, 3)), ((0, end), (width, 2))]
        top = end
    else:
        # The front of the fin is that of the block, so that they are one part.
        corners = [*corners[:2], (0, 2 + end), (0, 2), (-1, 2)]
        floor = [(0, 1, 3), (1, 2, 3), (0, 3, 4)]
        solid = [((-1, 0), (0, 2))]
        top = 2 + end
    low = rng.uniform(0.05, 0.4) * top
    high = top if rng.random() < 0.3 else rng.uniform(0.5, 0.95) * top
    box = convex_body(box_corners((0, low, -0.2), (rng.uniform(0.3, 2), high, 0.8 * height)))
    n, floor = len(corners), np.array(floor)
    points = np.vstack([np.column_stack([corners, np.full(n, z)]) for z in (0.0, height)])
    walls = [(k, (k + 1) % n, (k + 1) % n + n) for k in range(n)]
    walls += [(k, (k + 1) % n + n, k + n) for k in range(n)]
    faces = np.vstack([walls, floor[:, ::-1], floor + n, box.faces + 2 * n])
    bodies = [convex_body(box_corners((*a, 0.0), (*b, height))) for a, b in solid] + [box]
    R = rotation(rng) if rng.random() < 0.7 else np.eye(3)
    scale, origin = 10.0 ** rng.uniform(-2, 2), rng.choice([0.0, 1.0]) * rng.normal(size=3)
    bodies = [moved(body, R, scale, origin) for body in bodies]
    vertices = (np.vstack([points, box.vertices]) + origin) @ R.T * scale
    return vertices, rng.permutation(faces), solid_of_bodies(bodies, [False] * len(bodies))


def box_corners(lower, upper):
    """Return the corners of a box."""
    return np.array(list(itertools.product(*zip(lower, upper, strict=True))), dtype=float)


@pytest.mark.parametrize("fold", ["flap", "fin"])
@pytest.mark.parametrize("seed", range(12))
def test_a_fold_that_another_body_touches_is_no_surface(seed, fold):
    """Pressing the body and the folded part together moves one side of the fold alone."""
    rng = np.random.default_rng([seed, 9])
    vertices, faces, solid = folded_beside_a_body(rng, fold)
    mesh = Mesh(vertices=vertices, faces=faces)
    report = surface_of(mesh).report
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    points = rng.uniform(lower, upper, (400, 3))
    phi = signed_distances(mesh, points)
    assert (report.is_closed, report.parts) == (True, 2), str(report)
    truth = distances(boundary(solid), points) * np.where(inside(solid, points), -1.0, 1.0)
    np.testing.assert_allclose(phi, truth, rtol=0.0, atol=1e-11 * solid.size)


@pytest.mark.parametrize("seed", range(6))
def test_a_body_without_thickness_is_a_sheet_however_it_is_turned(seed):
    """Cut into other triangles in front than behind, so that rounding gives it a volume."""
    rng = np.random.default_rng(seed)
    card = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
    sides = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)])
    R, origin = (np.eye(3), np.zeros(3)) if seed == 0 else (rotation(rng), rng.normal(size=3))
    vertices = np.vstack([card, box_corners((2, 0, 0), (3, 1, 1))]) @ R.T + origin
    faces = np.vstack([sides, np.array(SIDES) + 4])
    mesh = Mesh(vertices=vertices, faces=faces)
    report = surface_of(mesh).report
    assert (report.parts, report.sheets, report.is_closed) == (1, 1, False)
    assert "folds back on itself" in report.reason
    beside = np.array([(0.3, 0.6, 0.2), (0.3, 0.6, -0.1), (2.4, 0.5, 0.6)]) @ R.T + origin
    np.testing.assert_allclose(signed_distances(mesh, beside), [0.2, 0.1, -0.4], atol=1e-14)
