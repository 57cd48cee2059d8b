"""Whatever is too small or too thin to be kept in a union is counted, with its size."""

import numpy as np
import pytest

from scene_graph_ros.geometry.meshes.solids.mesh_report import merged, Repair
from scene_graph_ros.geometry.meshes.solids.solid import solid_of
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

BOX = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SIDES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)])
SIDES = np.vstack([SIDES, [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]])

# Two boxes in the form of an L; what is at (0.75, 0.75, 0.5) is in the box around both only.
L = [((0.0, 0.0, 0.0), (1.0, 0.25, 1.0)), ((0.0, 0.0, 0.0), (0.25, 1.0, 1.0))]
BESIDE = np.array([0.75, 0.75, 0.5])


def solid_with(lower, extent):
    """Return the solid of an L and of a box, turned, so that no coordinate is a short number."""
    c, s = np.cos(0.7), np.sin(0.7)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    boxes = [*L, (lower, np.asarray(lower) + extent)]
    corners = [np.asarray(a) + BOX * (np.asarray(b) - np.asarray(a)) for a, b in boxes]
    faces = np.vstack([SIDES + 8 * k for k in range(len(boxes))])
    middle = np.asarray(lower) + 0.5 * np.asarray(extent)
    return solid_of(np.vstack(corners) @ R.T, faces, 1e-6), (middle @ R.T)[None]


@pytest.mark.parametrize("extent", [3e-12, 1e-11, 4e-11, 1e-10])
def test_a_body_of_a_few_times_1e_12_of_the_whole_is_kept(extent):
    """It has no edge but its own, so that none of them is a needle of rounding."""
    solid, middle = solid_with(BESIDE, extent)
    assert (solid.report.parts, solid.report.repairs) == (3, ())
    assert winding_numbers(middle, solid.vertices, solid.triangles)[0] == 1


def test_a_feature_that_becomes_one_vertex_is_counted_with_its_size():
    """Half of a small body is in a face of a large one: it is gone with the needles around it."""
    extent = 2e-11
    solid, _ = solid_with((1.0 - 0.5 * extent, 0.1, 0.5), extent)
    (repair,) = solid.report.repairs
    assert repair.kind == "features smaller than 5e-11 of the size dropped"
    assert repair.count == 1
    # Turned, it is as long as its diagonal along an axis, at most.
    assert extent <= repair.size <= np.sqrt(3.0) * extent


def test_a_body_thinner_than_rounding_is_counted_with_its_size():
    """A plate of 1e-13 of the whole: the union has nothing of it."""
    extent = np.array([0.1, 0.1, 1e-13])
    solid, middle = solid_with(BESIDE, extent)
    assert winding_numbers(middle, solid.vertices, solid.triangles)[0] == 0
    (repair,) = solid.report.repairs
    assert (repair.kind, repair.count) == ("parts as thin as rounding dropped", 1)
    assert 0.1 <= repair.size <= 0.2


def test_a_slit_is_reported_with_its_width():
    """Two blocks that are 3e-8 of the size apart."""
    gap = 3e-8
    corners = np.vstack([BOX, BOX + np.array([1.0 + gap, 0.0, 0.0])])
    solid = solid_of(corners, np.vstack([SIDES, SIDES + 8]), 1e-6)
    (repair,) = solid.report.repairs
    assert repair.kind == "slits pressed together"
    np.testing.assert_allclose(repair.size, gap, rtol=1e-6)
    assert "up to 3e-08 m" in str(solid.report)


def test_repairs_of_a_kind_are_one_with_the_largest_size():
    """The place is that of the first one; kinds keep their order."""
    one = Repair("a", 2, (1.0, 2.0, 3.0), 0.5)
    found = merged([one, Repair("b", 1, (0.0, 0.0, 0.0)), Repair("a", 3, (4.0, 5.0, 6.0), 0.7)])
    assert [(r.kind, r.count, r.point, r.size) for r in found] == [
        ("a", 5, (1.0, 2.0, 3.0), 0.7),
        ("b", 1, (0.0, 0.0, 0.0), None),
    ]
    assert str(found[1]) == "1 b (one at (0, 0, 0))"


@pytest.mark.parametrize("at", [(400.0, 500.0, 300.0), (1000.0, 950.0, 300.0)])
@pytest.mark.parametrize("thickness", [3e-13, 3e-10])
def test_a_speck_is_dropped_also_where_rounding_makes_it_flat(at, thickness):
    """Inside of a box or beside it: of 3e-13 of the whole, with an inside or without one."""
    speck = np.array([(0, 0, 0), (3e-10, 0, 0), (0, 3e-10, 0), (1e-10, 1e-10, thickness)])
    faces = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]) + 8
    vertices = np.vstack([900.0 * BOX, np.array(at) + speck])
    solid = solid_of(vertices, np.vstack([SIDES, faces]), 1e-6)
    assert solid.report.is_closed, str(solid.report)
    (repair,) = solid.report.repairs
    assert (repair.kind, repair.count) == ("parts smaller than 1e-12 of the whole dropped", 1)
    assert repair.size == pytest.approx(3e-10, rel=1e-3)
