"""Parts that run inwards: cavities where they are wholly inside, also along faces; else bodies."""

from mesh_distances import signed_distances
import numpy as np
import pytest

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.solids.solid import solid_of

SIDES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
        *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ]
)
BLOCK = ((0, 0, 0), (3, 3, 3))
C, S = np.cos(0.7), np.sin(0.7)
TURNED = np.array([[C, -S, 0], [S, C, 0], [0, 0, 1]]) @ np.array(
    [[1, 0, 0], [0, C, -S], [0, S, C]]
)

# The boxes that run inwards, others that run outwards, how many cavities, the volume, and signed
# distances of points.
CASES = {
    "flush with a face": ([((1, 1, 1), (2, 2, 3))], [], 1, 25.0, {(1.5, 1.5, 2.9): 0.5}),
    "at an edge": ([((1, 2, 1), (2, 3, 3))], [], 1, 25.0, {(1.5, 2.9, 2.9): 0.5}),
    "in a corner": ([((2, 2, 2), (3, 3, 3))], [], 1, 26.0, {(2.9, 2.9, 2.9): 0.9}),
    "through all": ([((1, 1, 0), (2, 2, 3))], [], 1, 24.0, {(1.5, 1.5, 2.9): 0.5}),
    "the upper half": ([((0, 0, 2), (3, 3, 3))], [], 1, 18.0, {(1.5, 1.5, 2.9): 0.9}),
    "out by less than the tolerance": (
        [((1, 1, 1), (2, 2, 3 + 1e-6))],
        [],
        1,
        25.0,
        {(1.5, 1.5, 2.9): 0.5},
    ),
    "two in a row": (
        [((0.5, 1, 1), (1.5, 2, 2)), ((1.5, 1, 1), (2.5, 2, 2))],
        [],
        2,
        25.0,
        {(1.49, 1.5, 1.5): 0.5},
    ),
    "a box over the mouth": (
        [((1, 1, 1), (2, 2, 3))],
        [((0.5, 0.5, 3), (2.5, 2.5, 4))],
        1,
        29.0,
        {(1.5, 1.5, 2.9): 0.1, (1.5, 1.5, 3.1): -0.1},
    ),
    "a core that reaches out": (
        [((1, 1, 1), (2, 2, 3))],
        [((1.2, 1.2, 0.5), (1.8, 1.8, 3.5))],
        1,
        25.0 + 0.36 * 2.5,
        {(1.1, 1.5, 2.9): 0.1, (1.5, 1.5, 2.0): -0.3},
    ),
    "partly out": ([((1, 1, 1), (2, 2, 3.5))], [], 0, 27.5, {(1.5, 1.5, 3.2): -0.3}),
    "by more than the tolerance": ([((1, 1, 1), (2, 2, 3 + 1e-4))], [], 0, 27.0001, {}),
    "in none of two wholly": (
        [((1, 1, 1), (2, 2, 5))],
        [((0, 0, 3), (3, 3, 6))],
        0,
        54.0,
        {(1.5, 1.5, 3.0): -1.5},
    ),
    "in an even number": (
        [((1, 1, 1), (2, 2, 2))],
        [((0.5, 0.5, 0.5), (2.5, 2.5, 2.5))],
        0,
        27.0,
        {(1.5, 1.5, 1.5): -1.5},
    ),
    "outside, on a face": ([((3, 1, 1), (4, 2, 2))], [], 0, 28.0, {(3.5, 1.5, 1.5): -0.5}),
    "outside alone": ([((4, 1, 1), (5, 2, 2))], [], 0, 28.0, {(4.5, 1.5, 1.5): -0.5}),
    "as large as the block": ([BLOCK], [], 0, 27.0, {(1.5, 1.5, 1.5): -1.5}),
}


FILLS = "parts that reach out of one which runs the other way taken as bodies"
REPORTED = {
    "out by less than the tolerance": ["cavities that reach out of their part cut off"],
    "partly out": [FILLS],
    "by more than the tolerance": [FILLS],
    "in none of two wholly": [FILLS],
}
"""What the report has of them."""


def box(lower, upper):
    """Return the corners (8, 3) of a box."""
    axes = list(zip(lower, upper, strict=True))
    return np.array([(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]], dtype=float)


def volume(solid):
    """Return the volume inside by the divergence theorem."""
    a, b, c = (solid.vertices[solid.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


@pytest.mark.parametrize("axes", [np.eye(3), TURNED], ids=["plain", "turned"])
@pytest.mark.parametrize("case", list(CASES))
def test_inward_parts_are_cavities_where_they_are_wholly_inside(case, axes):
    """Open where they are flush with a face; what is not wholly inside is a body like others."""
    inward, outward, cavities, expected, asked = CASES[case]
    boxes = [BLOCK, *outward, *inward]
    faces = [SIDES + 8 * k for k in range(len(boxes) - len(inward))]
    faces += [SIDES[:, ::-1] + 8 * k for k in range(len(faces), len(boxes))]
    vertices = np.vstack([box(*corners) for corners in boxes]) @ axes.T
    solid = solid_of(vertices, np.vstack(faces), 1e-6)
    assert (solid.report.cavities, solid.report.is_closed) == (cavities, True)
    assert volume(solid) == pytest.approx(expected, rel=1e-10)
    assert [repair.kind for repair in solid.report.repairs] == REPORTED.get(case, [])
    if asked:
        points = np.array(list(asked)) @ axes.T
        found = signed_distances(Mesh(vertices=vertices, faces=np.vstack(faces)), points)
        np.testing.assert_allclose(found, list(asked.values()), atol=1e-11)


@pytest.mark.parametrize("seed", range(3))
def test_a_pocket_in_single_precision_is_one(seed):
    """Rounding lifts its face out of the block's, and leaves some of it inside."""
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    vertices = np.vstack([box(*BLOCK), box((1, 1, 1), (2, 2, 3))]) @ axes.T + rng.normal(size=3)
    way = 1 if np.linalg.det(axes) > 0.0 else -1
    faces = np.vstack([SIDES[:, ::way], SIDES[:, ::-way] + 8])
    solid = solid_of(vertices.astype(np.float32).astype(float), faces, 1e-6)
    assert solid.report.cavities == 1
    assert volume(solid) == pytest.approx(25.0, abs=1e-4)


def test_a_part_that_crosses_itself_outside_is_no_cavity():
    """A box whose outer face is folded, so that differences of bodies have negative volumes."""
    inner = box((1, 1, 1), (2, 2, 3.001))
    inner[5, :2] = (1.2, 1.8)  # a corner of its top beyond the diagonal of the others
    vertices = np.vstack([box(*BLOCK), inner])
    solid = solid_of(vertices, np.vstack([SIDES, SIDES[:, ::-1] + 8]), 1e-6)
    assert solid.report.cavities == 0
