"""Boxes on a lattice that touch and overlap, each face cut as it likes: T vertices everywhere.

An edge of one box may lie on an edge of another one, so that both are hidden where edges are
counted, and not how triangles run through them.
"""

from boxes_in_one_mesh import Boxes, FACES
from mesh_distances import signed_distances
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from searching import times

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.solids.repair import repaired
from scene_graph_ros.geometry.meshes.sources import surface_of

HOW = {
    "as they are": {},
    "turned": {"is_turned": True},
    "turned, in single precision": {"is_turned": True, "is_single": True},
    "with doubled triangles": {"doubles": 2},
    "in whole faces": {"pieces": 1},
    "in whole faces, with doubled triangles": {"pieces": 1, "doubles": 2},
}


def split(rng, corners, most):
    """Return triangles (n, 3, 3), each cut at points of its sides into ``most`` pieces at most."""
    result = []
    for corner in corners:
        pieces = [corner]
        for _ in range(rng.integers(most)):
            triangle = pieces.pop(rng.integers(len(pieces)))
            k, share = rng.integers(3), rng.choice([0.5, 0.25, 0.3])
            point = (1.0 - share) * triangle[k] + share * triangle[(k + 1) % 3]
            one, other = triangle.copy(), triangle.copy()
            one[(k + 1) % 3], other[k] = point, point
            pieces += [one, other]
        result += pieces
    return np.array(result)


def boxes_in_pieces(rng, *, is_turned=False, is_single=False, doubles=0, pieces=3):
    """Return boxes, and their triangles (n, 3, 3)."""
    lowers = rng.integers(0, 4, (rng.integers(2, 5), 3))
    uppers = lowers + rng.integers(1, 4, lowers.shape)
    R = Rotation.random(rng=rng).as_matrix() if is_turned else None
    boxes = Boxes(*zip(lowers, uppers, strict=True), R=R)
    corners = []
    for lower, upper in zip(lowers, uppers, strict=True):
        axes = np.stack([lower, upper], axis=1).astype(float)
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        corners.append(split(rng, points[FACES], pieces))
    corners = np.concatenate(corners)
    corners = boxes.placed(corners.reshape(-1, 3)).reshape(-1, 3, 3)
    corners = np.concatenate([corners, corners[rng.integers(len(corners), size=doubles)]])
    return boxes, corners.astype(np.float32).astype(float) if is_single else corners


@pytest.mark.parametrize("how", HOW)
def test_boxes_with_split_faces_that_touch_are_one_solid(how):
    """Distances inside and outside are those to its boundary; single precision may say no."""
    is_single = "single" in how
    silent = 0
    for seed in range(40):
        rng = np.random.default_rng((7, seed))
        boxes, corners = boxes_in_pieces(rng, **HOW[how])
        rows = rng.permutation(len(corners))
        mesh = Mesh(
            vertices=corners[rows].reshape(-1, 3), faces=np.arange(3 * len(rows)).reshape(-1, 3)
        )
        report = surface_of(mesh).report
        assert report.is_closed or is_single, (seed, str(report))
        points = rng.uniform(*boxes.reach, (200, 3))
        phi, wanted = signed_distances(mesh, boxes.placed(points)), boxes.distances(points)
        size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        wrong = np.abs(phi - wanted) > (3e-6 if is_single else 1e-11) * size
        silent += bool(wrong.any() and report.is_closed)
        assert is_single or not wrong.any(), (seed, points[wrong][0], str(report))
    assert silent == 0


def boxes_in_a_larger_one(rng):
    """Return boxes, some of them hollow, and their triangles (n, 3, 3) in single precision."""
    lowers, uppers = rng.integers(0, 4, (int(rng.integers(3, 6)), 3)), None
    uppers = lowers + rng.integers(1, 4, lowers.shape)
    lowers[0], uppers[0] = -1, 8
    volumes = (uppers - lowers).prod(axis=1)
    hollow = []
    for k in np.flatnonzero(rng.random(len(lowers)) < 0.5):
        around = (lowers <= lowers[k]).all(axis=1) & (uppers >= uppers[k]).all(axis=1)
        # In the largest one alone, so that it is a cavity by the rule.
        if np.count_nonzero(around & (volumes > volumes[k])) == 1:
            hollow.append(int(k))
    boxes = Boxes(
        *zip(lowers, uppers, strict=True),
        hollow=hollow,
        R=Rotation.random(rng=rng).as_matrix(),
        size=10.0 ** rng.uniform(-9, 4),
        origin=rng.normal(size=3) * rng.choice([0, 1, 5]),
    )
    corners = []
    for k, (lower, upper) in enumerate(boxes.boxes):
        axes = np.stack([lower, upper], axis=1)
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        pieces = split(rng, points[FACES], int(rng.integers(1, 5)))
        corners.append(pieces[:, ::-1] if k in boxes.hollow else pieces)
    corners = np.concatenate(corners)
    corners = boxes.placed(corners.reshape(-1, 3)).reshape(-1, 3, 3)
    corners = np.concatenate([corners, corners[rng.integers(len(corners), size=2)]])
    return boxes, corners.astype(np.float32).astype(float)


@pytest.mark.search
def test_hollow_boxes_in_single_precision_have_their_sides_or_are_reported():
    """Bodies that touch hollows may be joined with them: then a part winds around points by -1."""
    seeds = [163, 247, 315, 319, 492, 503, 530, 604, 775, *range(times(40))]
    is_open = 0
    for seed in seeds:
        rng = np.random.default_rng((8, seed))
        boxes, corners = boxes_in_a_larger_one(rng)
        if len(np.unique(boxes.boxes, axis=0)) < len(boxes.boxes):
            continue  # of two cavities that are the same, each is in the other
        rows = rng.permutation(len(corners))
        mesh = Mesh(
            vertices=corners[rows].reshape(-1, 3), faces=np.arange(3 * len(rows)).reshape(-1, 3)
        )
        report = surface_of(mesh).report
        if not report.is_closed:
            assert report.reason
            is_open += 1
            continue
        points = rng.uniform(*boxes.reach, (300, 3))
        phi, wanted = signed_distances(mesh, boxes.placed(points)), boxes.distances(points)
        clear = np.abs(wanted) > 3e-6 * np.abs(corners).max()
        wrong = clear & ((phi < 0.0) != (wanted < 0.0))
        assert not wrong.any(), (seed, points[wrong][0], str(report))
    assert is_open <= 0.05 * len(seeds)


def test_edges_that_hide_each_other():
    """Two squares, one upon the other, with a corner more on a side: its edges are split alike."""
    lower = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1, 0, 0)], dtype=float)
    # The whole side of each hides that of the other; the half sides are open.
    sides = [(0, 1, 2), (0, 2, 3)]
    back = [(1, 0, 3), (1, 3, 2)]
    halves = [(0, 4, 3), (4, 1, 3), (1, 2, 3)]
    triangles = np.array(sides + back + halves + [row[::-1] for row in halves])
    kept, repairs = repaired(lower, triangles, 1e-6, layers=None)
    assert not repairs
    assert len(kept) == len(triangles)
    kept, repairs = repaired(
        lower, np.array(sides + [row[::-1] for row in halves]), 1e-6, layers=None
    )
    assert [(r.kind, r.count) for r in repairs] == [("T vertices", 1)]
    ends = np.stack([kept, np.roll(kept, -1, axis=1)], axis=2).reshape(-1, 2)
    balance = np.zeros((5, 5), dtype=int)
    np.add.at(balance, tuple(ends.T), 1)
    np.testing.assert_array_equal(balance, balance.T)
