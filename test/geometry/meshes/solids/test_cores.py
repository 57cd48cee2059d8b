"""Bodies in cavities, flush with walls that another cavity takes away: no skin is left there."""

from boxes_in_one_mesh import Boxes
from constructed_solids import rotation
from mesh_distances import signed_distances
import numpy as np
import pytest

from scene_graph_ros.geometry.meshes.sources import surface_of

BLOCK = ((0, 0, 0), (6, 6, 6))
CAVITY = ((1, 1, 1), (4, 5, 5))
CASES = {
    # The solid winds once on both sides of the wall, and not at all in the second cavity.
    "at a wall": Boxes(
        BLOCK,
        CAVITY,
        ((2, 2.2, 1.7), (4, 3.6, 3.9)),
        ((3.1, 1.3, 2.5), (5, 4.2, 4.6)),
        hollow=(1, 3),
    ),
    "in a corner": Boxes(
        BLOCK,
        CAVITY,
        ((2, 2.2, 1), (4, 3.6, 3.9)),
        ((3.1, 1.3, 0.4), (5, 4.2, 2.6)),
        hollow=(1, 3),
    ),
    "two beside each other": Boxes(
        BLOCK,
        CAVITY,
        ((1.4, 1.5, 1.6), (2.5, 4, 4)),
        ((2.5, 1.8, 1.2), (3.6, 3.5, 4.5)),
        ((1.8, 2, 2), (3.2, 3, 5.5)),
        hollow=(1, 4),
    ),
    "two, and a third through both": Boxes(
        BLOCK,
        CAVITY,
        ((1.4, 1.5, 1.6), (2.5, 4, 4)),
        ((2.5, 1.8, 1.2), (3.6, 3.5, 4.5)),
        ((1.6, 2.3, 2.2), (3.3, 2.7, 4.2)),
        ((1.8, 2, 2), (3.2, 3, 5.5)),
        hollow=(1, 5),
    ),
    "through the wall of two cavities": Boxes(
        BLOCK,
        ((1, 1, 1), (3, 5, 5)),
        ((3, 1.5, 1.5), (5, 4, 4)),
        ((2, 2, 2), (4, 3, 3)),
        hollow=(1, 2),
    ),
}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("boxes", CASES.values(), ids=list(CASES))
def test_distances_are_those_of_the_boxes_counted(boxes, seed):
    """Turned, so that flush faces are apart or overlap by rounding."""
    rng = np.random.default_rng(seed)
    boxes.R, boxes.size = (np.eye(3), 1.0) if seed == 0 else (rotation(rng), 10.0 ** rng.normal())
    boxes.origin = np.zeros(3) if seed < 2 else 3.0 * rng.normal(size=3)
    points = rng.uniform(0.2, 5.8, (600, 3))
    mesh = boxes.mesh
    report = surface_of(mesh).report
    assert (report.is_closed, report.cavities) == (True, len(boxes.hollow)), str(report)
    found = signed_distances(mesh, boxes.placed(points))
    np.testing.assert_allclose(found, boxes.distances(points), rtol=0.0, atol=6.0 * boxes.error)
