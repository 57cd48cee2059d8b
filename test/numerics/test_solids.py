"""Solids of parts against constructive truth, and real robots' meshes against winding numbers."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from searching import times

from scene_graph_ros.geometry.meshes.io import read_mesh
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers
from scene_graph_ros.geometry.meshes.surfaces import build_surface

FACES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
        *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ]
)
GRID = 4
"""Corners are on a lattice: faces, edges and corners touch, boxes overlap and are nested."""


def solid_angles(points, vertices, triangles):
    """Return winding numbers of (n, 3) points by solid angles (van Oosterom, Strackee 1983)."""
    result = np.zeros(len(points))
    for i, p in enumerate(points):
        a, b, c = (vertices[triangles[:, k]] - p for k in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        sine = np.einsum("ij,ij->i", a, np.cross(b, c))
        cosine = la * lb * lc + lc * np.einsum("ij,ij->i", a, b)
        cosine += la * np.einsum("ij,ij->i", b, c) + lb * np.einsum("ij,ij->i", c, a)
        result[i] = np.arctan2(sine, cosine).sum() / (2.0 * np.pi)
    return result


def lattice_boxes(rng):
    """Return lower and upper corners (n, 3) of boxes on the lattice."""
    count = rng.integers(2, 6)
    lower = rng.integers(0, GRID, (count, 3)).astype(float)
    return lower, lower + rng.integers(1, GRID, (count, 3))


def is_inside(points, lower, upper):
    """Return whether each point is in a box."""
    above = points[:, None] > lower
    return (above & (points[:, None] < upper)).all(axis=2).any(axis=1)


@pytest.mark.search
def test_boxes_that_touch_overlap_or_are_nested_are_one_solid():
    """Turned and of any size: sides are those of the boxes, and no surface is inside of them."""
    rng = np.random.default_rng(3)
    for _ in range(times(25)):
        lower, upper = lattice_boxes(rng)
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        axes *= np.sign(np.linalg.det(axes))
        size, origin = 10.0 ** rng.uniform(-4, 4) / GRID, rng.normal(size=3)
        corners = [
            [(x, y, z) for x in b[:, 0] for y in b[:, 1] for z in b[:, 2]]
            for b in np.stack([lower, upper], axis=1)
        ]
        points = (np.concatenate(corners) + origin) @ axes.T * size
        faces = (FACES + 8 * np.arange(len(lower))[:, None, None]).reshape(-1, 3)
        is_turned = rng.random(len(faces)) < 0.3
        faces = np.where(is_turned[:, None], faces[:, ::-1], faces)[rng.permutation(len(faces))]
        surface = build_surface(points, faces, name="boxes")
        assert surface.report.is_closed, surface.report
        asked = rng.uniform(-1.0, 2.0 * GRID, (200, 3))
        placed = (asked + origin) @ axes.T * size
        found = winding_numbers(placed, surface.vertices, surface.triangles) > 0
        np.testing.assert_array_equal(found, is_inside(asked, lower, upper))
        middles = surface.vertices[surface.triangles].mean(axis=1) / size @ axes - origin
        offsets = 1e-4 * np.array(np.meshgrid(*3 * [(-1, 1)])).reshape(3, 8).T
        deep = np.all([is_inside(middles + o, lower, upper) for o in offsets], axis=0)
        assert not deep.any()


def robot_meshes():
    """Return the files of example-robot-data; none where it is not installed."""
    found = importlib.util.find_spec("cmeel")
    if found is None or found.origin is None:
        return []
    folder = Path(found.origin).parents[1] / "cmeel.prefix/share/example-robot-data/robots"
    return sorted(p for p in folder.rglob("*") if p.suffix.lower() in (".stl", ".dae", ".obj"))


FILES = robot_meshes()


@pytest.mark.search
@pytest.mark.skipif(not FILES, reason="example-robot-data is not installed")
def test_meshes_of_robots_have_the_sides_of_their_winding_numbers():
    """A point inside has a number of 1/2 at least, by solid angles of the solid's boundary."""
    rng = np.random.default_rng(4)
    chosen = rng.permutation(len(FILES))[: min(times(6), len(FILES))]
    for path in (FILES[i] for i in chosen):
        if "anymal_foot.dae" in path.name:
            continue  # two of the set's files are no meshes: these are refused
        vertices, triangles = read_mesh(path)
        if not 0 < len(triangles) <= 20_000:
            continue
        surface = build_surface(vertices, triangles, name=path.name)
        of_solid = surface.triangles[surface.is_solid]
        if not len(of_solid):
            continue
        lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        points = rng.uniform(lower, upper, (40, 3))
        angles = solid_angles(points, surface.vertices, of_solid)
        counted = winding_numbers(points, surface.vertices, of_solid)
        np.testing.assert_allclose(angles, counted, atol=1e-6, err_msg=str(path))
        if surface.report.parts == 1 and not surface.report.repairs and surface.report.is_closed:
            raw = np.abs(solid_angles(points, vertices, triangles))
            np.testing.assert_array_equal(raw >= 0.5, counted > 0, err_msg=str(path))
