"""Slits between parts: closed up to the tolerance, in any orientation, and told."""

from constructed_solids import rotation
import numpy as np
import pytest

from scene_graph_ros.geometry.meshes.solids.solid import solid_of
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

SIDES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
        *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ]
)
SEEDS = range(4)


def box(lower, upper):
    """Return the corners (8, 3) of a box, those of its lowest x first."""
    axes = list(zip(lower, upper, strict=True))
    return np.array([(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]], dtype=float)


def placed(seed, corners, points, hollow=()):
    """Return vertices, faces and points, all turned and moved; hollow boxes are inside out."""
    rng = np.random.default_rng(seed)
    axes, origin = rotation(rng), rng.normal(size=3)
    faces = [
        (SIDES[:, ::-1] if k in hollow else SIDES) + 8 * k for k in rng.permutation(len(corners))
    ]
    vertices = np.vstack(corners) @ axes.T + origin
    return vertices, np.vstack(faces), np.atleast_2d(points) @ axes.T + origin


def repairs_of(solid):
    """Return how many there are of each kind."""
    return {repair.kind: repair.count for repair in solid.report.repairs}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("gap", [1e-9, 3e-7, 9e-7])
def test_a_slit_is_closed_and_told(seed, gap):
    """A box above another one: the slit's middle is inside, and nothing moves by more than it."""
    corners = [box((0, 0, 0), (2, 2, 1)), box((0.3, 0.4, 1 + gap), (1.5, 1.6, 2))]
    asked = [(0.7, 0.8, 1 + 0.5 * gap), (0.7, 0.8, 1 + 0.01 * gap), (1.7, 0.8, 1 + 0.6 * gap)]
    vertices, faces, points = placed(seed, corners, asked)
    solid = solid_of(vertices, faces, 1e-6)
    found = winding_numbers(points, solid.vertices, solid.triangles)
    # The third is above the lower box, beside the upper one, by more than the half of the gap.
    assert found.tolist() == [1, 1, 0]
    assert repairs_of(solid)["slits pressed together"] > 0
    assert solid.solid_parts == 1


@pytest.mark.parametrize("seed", SEEDS)
def test_a_gap_above_the_tolerance_stays(seed):
    """Two parts, and nothing to report."""
    corners = [box((0, 0, 0), (2, 2, 1)), box((0.3, 0.4, 1 + 4e-6), (1.5, 1.6, 2))]
    vertices, faces, points = placed(seed, corners, [(0.7, 0.8, 1 + 2e-6)])
    solid = solid_of(vertices, faces, 1e-6)
    assert winding_numbers(points, solid.vertices, solid.triangles).tolist() == [0]
    assert (solid.solid_parts, solid.report.repairs) == (2, ())


@pytest.mark.parametrize("seed", SEEDS)
def test_faces_that_cross_in_a_slit_are_one(seed):
    """A box tilted by 4e-7 about a line through the face that it stands on."""
    upper = box((-0.6, -0.6, 0), (0.6, 0.6, 1))
    upper[:, 2] += 4e-7 * (upper[:, 0] + 0.3 * upper[:, 1])
    asked = [(x, y, 2e-7 * (x + 0.3 * y)) for x in (-0.5, 0.2, 0.5) for y in (-0.4, 0.3)]
    vertices, faces, points = placed(seed, [box((-1, -1, -1), (1, 1, 0)), upper], asked)
    solid = solid_of(vertices, faces, 1e-6)
    assert (winding_numbers(points, solid.vertices, solid.triangles) == 1).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_what_fills_a_cavity_closes_it(seed):
    """A core that is smaller than its cavity by less than the tolerance, on all sides."""
    outer, g = box((0, 0, 0), (3, 3, 3)), 4e-7
    corners = [outer, box((1, 1, 1), (2, 2, 2)), box((1 + g,) * 3, (2 - g,) * 3)]
    asked = [(1 + 0.5 * g, 1.4, 1.6), (1.3, 2 - 0.5 * g, 1.5), (1.4, 1.5, 1 + 0.5 * g)]
    vertices, faces, points = placed(seed, corners, asked, hollow=(1,))
    solid = solid_of(vertices, faces, 1e-6)
    assert solid.report.cavities == 1
    assert (winding_numbers(points, solid.vertices, solid.triangles) == 1).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_thin_cavity_and_a_thin_wall_stay(seed):
    """Only faces that look at each other across what is outside are pressed together."""
    thin = 4e-7
    cavity = box((1, 1, 2 - 2 * thin), (2, 2, 2 - thin))
    asked = [(1.4, 1.5, 2 - 1.5 * thin), (1.4, 1.5, 2 - 0.5 * thin), (1.4, 1.5, 2 - 2.5 * thin)]
    vertices, faces, points = placed(seed, [box((0, 0, 0), (3, 3, 2)), cavity], asked, hollow=(1,))
    solid = solid_of(vertices, faces, 1e-6)
    found = winding_numbers(points, solid.vertices, solid.triangles)
    assert (solid.report.cavities, solid.report.repairs) == (1, ())
    assert found.tolist() == [0, 1, 1]
