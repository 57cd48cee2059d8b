"""The closed form of two boxes, in positions where features coincide up to anything.

The answers are proven, not compared: no two bodies are nearer than the gap along a direction, nor
further apart than two of their points; and overlapping boxes leave along one of the 15 directions
of the separating axis test, which are measured here in numpy.
"""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry.query.distance.distance_box_box import distance_box_box

COUNT = 4000
FAMILIES = ["aligned", "nearly aligned", "common axis", "nearly common axis", "any"]


class Boxes(NamedTuple):
    """Many pairs: half extents (n, 3), rotations (n, 3, 3), positions of B in A (n, 3)."""

    size_A: np.ndarray
    size_B: np.ndarray
    R: np.ndarray
    p: np.ndarray

    @property
    def L(self):
        """Return the size of each pair, which bounds are relative to."""
        return 2.0 * np.maximum(self.size_A, self.size_B).max(axis=1)


class Answers(NamedTuple):
    """One row per pair, in A."""

    phi: np.ndarray
    x: np.ndarray
    y: np.ndarray
    n: np.ndarray
    unique: np.ndarray


def solve(boxes):
    """Return the Answers of the kernel."""
    rows = [
        distance_box_box(tuple(a), tuple(b), tuple(R), tuple(p), np.inf)
        for a, b, R, p in zip(
            boxes.size_A.tolist(),
            boxes.size_B.tolist(),
            boxes.R.reshape(-1, 9).tolist(),
            boxes.p.tolist(),
            strict=True,
        )
    ]
    return Answers(*map(np.array, zip(*rows, strict=True)))


def unit(v):
    """Return v / |v|."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def into_B(boxes, v):
    """Return vectors of A in B."""
    return np.einsum("nij,ni->nj", boxes.R, v)


def gap_along(boxes, n):
    """Return how far the boxes are apart along unit vectors n, from B to A."""
    extents = (boxes.size_A * abs(n)).sum(1) + (boxes.size_B * abs(into_B(boxes, n))).sum(1)
    return -(boxes.p * n).sum(1) - extents


def widest_gap(boxes):
    """Return the largest gap along the 15 directions: minus the depth of overlapping boxes."""
    e = np.eye(3)
    axes = [np.broadcast_to(e[i], boxes.p.shape) for i in range(3)]
    axes += [unit(boxes.R[:, :, j]) for j in range(3)]
    for i in range(3):
        for j in range(3):
            product = np.cross(e[i], boxes.R[:, :, j])
            is_axis = np.linalg.norm(product, axis=1, keepdims=True) > 1e-14
            axes.append(unit(np.where(is_axis, product, e[(i + 1) % 3])))
    return np.max([gap_along(boxes, sign * axis) for axis in axes for sign in (1.0, -1.0)], 0)


def faults(boxes, answers):
    """Return by how many L each answer is wrong, by what is wrong with it."""
    phi, x, y, n, _ = answers
    y_B = into_B(boxes, y - boxes.p)
    found = {
        "unit": abs(np.linalg.norm(n, axis=1) - 1.0) * boxes.L,
        "identity": np.linalg.norm(x - y - phi[:, None] * n, axis=1),
        "off A": abs((abs(x) - boxes.size_A).max(axis=1)),
        "off B": abs((abs(y_B) - boxes.size_B).max(axis=1)),
        "normal": abs(gap_along(boxes, n) - phi),
        "depth": np.maximum(widest_gap(boxes) - phi, 0.0),
    }
    return {name: (value / boxes.L).max() for name, value in found.items()}


def random_boxes(rng, family, count=COUNT):
    """Return pairs of a family of rotations whose features meet, nearly meet or are anywhere."""
    size_A, size_B = _sizes(rng, count), _sizes(rng, count)
    size_B = np.where(rng.random((count, 1)) < 0.3, size_A, size_B)
    factor = rng.choice([1.0, 1.0, 1.0, 1e-6, 1e-3], (count, 1))
    size_B = np.maximum(size_B * factor, 1e-9)
    R = _rotations(rng, family, count)
    L = 2.0 * np.maximum(size_A, size_B).max(axis=1, keepdims=True)
    x, n = _places(rng, size_A)
    y, _ = _places(rng, size_B)
    y = np.einsum("nij,nj->ni", R, y)
    small = L * rng.choice([0.0, 1.0, -1.0], (count, 1)) * 10.0 ** rng.uniform(-17, -1, (count, 1))
    meeting = x + small * n - y
    concentric = L * rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-17, 0, (count, 1))
    style = rng.integers(0, 6, (count, 1))
    return Boxes(size_A, size_B, R, np.where(style == 0, concentric, meeting))


def _sizes(rng, count):
    style = rng.integers(0, 3, (count, 1))
    thin = 10.0 ** rng.uniform(-4.0, 0.0, (count, 3))
    round_ = rng.choice([0.1, 0.2, 1 / 3], (count, 3))
    return np.where(
        style == 0, round_, np.where(style == 1, thin, rng.uniform(0.1, 1, (count, 3)))
    )


def _rotations(rng, family, count):
    R = Rotation.random(count, rng=rng).as_matrix()
    if family != "any":
        R = Rotation.create_group("O").as_matrix().round()[rng.integers(0, 24, count)]
    if "common" in family:
        turns = np.eye(3)[rng.integers(0, 3, count)] * rng.uniform(0, 6, (count, 1))
        R = R @ Rotation.from_rotvec(turns).as_matrix()
    if "nearly" in family:
        tilts = rng.normal(size=(count, 3)) * rng.integers(0, 2, (count, 3))
        tilts = tilts * 10.0 ** rng.uniform(-16, -3, (count, 1))
        R = Rotation.from_rotvec(tilts).as_matrix() @ R
    return R


def _places(rng, size):
    """Return points of corners, edges and faces, often half way, and outward normals there."""
    signs = rng.choice([-1.0, 1.0], size.shape)
    is_free = rng.random(size.shape) < 0.4
    between = rng.choice([0.0, 0.5, -0.5, 1 / 3, rng.uniform(-1, 1)], size.shape)
    n = np.where(is_free, 0.0, signs) * rng.random(size.shape)
    n = np.where(abs(n).sum(axis=1, keepdims=True) > 0.0, n, [1.0, 0.0, 0.0])
    return np.where(is_free, between, signs) * size, unit(n)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", [1, 2])
def test_answers_prove_themselves(family, seed):
    """Witnesses on both surfaces, and a normal along which the boxes are as far as they are."""
    boxes = random_boxes(np.random.default_rng([seed, FAMILIES.index(family)]), family)
    found = faults(boxes, solve(boxes))
    assert max(found.values()) <= 1e-12, found


@pytest.mark.parametrize("family", FAMILIES)
def test_order_does_not_matter(family):
    """Exchanged boxes have the same distance."""
    boxes = random_boxes(np.random.default_rng([3, FAMILIES.index(family)]), family)
    p_BA = -into_B(boxes, boxes.p)
    turned = Boxes(boxes.size_B, boxes.size_A, np.swapaxes(boxes.R, 1, 2), p_BA)
    change = abs(solve(turned).phi - solve(boxes).phi) / boxes.L
    assert change.max() <= 1e-12


@pytest.mark.parametrize("family", FAMILIES)
def test_distance_changes_by_no_more_than_the_pose(family):
    """Moving B changes the distance by that length at most, and turning it by its arc."""
    rng = np.random.default_rng([4, FAMILIES.index(family)])
    boxes = random_boxes(rng, family)
    phi = solve(boxes).phi
    step = 10.0 ** rng.uniform(-14, -4, (COUNT, 1)) * boxes.L[:, None]
    moved = boxes._replace(p=boxes.p + step * unit(rng.normal(size=(COUNT, 3))))
    most = np.linalg.norm(moved.p - boxes.p, axis=1)
    assert ((abs(solve(moved).phi - phi) - most) / boxes.L).max() <= 1e-14
    angle = 10.0 ** rng.uniform(-14, -4, (COUNT, 1))
    turn = Rotation.from_rotvec(angle * unit(rng.normal(size=(COUNT, 3)))).as_matrix()
    turned = boxes._replace(R=turn @ boxes.R)
    most = angle[:, 0] * np.linalg.norm(boxes.size_B, axis=1)
    assert ((abs(solve(turned).phi - phi) - most) / boxes.L).max() <= 1e-14


@pytest.mark.parametrize("tilt", [0.0, 1e-15, 1e-14, 3e-14, 1e-12, 1e-8])
@pytest.mark.parametrize("gap", [1e-12, 1e-9, 1e-3, 0.1])
def test_nearly_parallel_edges(tilt, gap):
    """Edges parallel but for rounding are as far as they were placed, across both.

    B is turned by 0.9 rad about x, which both edges are along, and its corner in the y-z plane is
    placed at A's, ``gap`` away in a direction between the normals of the faces on either side.
    """
    half_A, half_B = np.array([0.5, 0.4, 0.3]), np.array([0.6, 0.2, 0.25])
    R = Rotation.from_rotvec([0.9, 0.0, 0.0]).as_matrix()
    # B's faces -y and -z are turned to -(0, cos, sin) and (0, sin, -cos).
    out = np.array([0.0, np.cos(0.4), np.sin(0.4)])
    corner_B = R @ np.array([0.0, -0.2, 0.25 * np.sign((R.T @ out)[2]) * -1.0])
    p = np.array([0.1, 0.4, 0.3]) + gap * out - corner_B
    tilted = Rotation.from_rotvec([0.0, tilt, -tilt]).as_matrix() @ R
    boxes = Boxes(*(np.array([v]) for v in (half_A, half_B, tilted, p)))
    answers = solve(boxes)
    assert answers.phi[0] == pytest.approx(gap, abs=2.0 * tilt + 1e-15)
    assert max(faults(boxes, answers).values()) <= 1e-13


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
def test_corners_next_to_each_other(gap):
    """Aligned cubes corner to corner are as far as their corners, with a normal that separates."""
    offset = 1.0 + gap * np.array([2.0, 3.0, 6.0]) / 7.0
    boxes = Boxes(np.full((1, 3), 0.5), np.full((1, 3), 0.5), np.eye(3)[None], offset[None])
    answers = solve(boxes)
    assert answers.phi[0] == pytest.approx(gap, abs=3e-16)
    np.testing.assert_allclose(answers.x[0], 0.5, atol=3e-16)
    assert max(faults(boxes, answers).values()) <= 1e-15


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5, 1.0 - 1e-12, 1.0])
@pytest.mark.parametrize("gap", [-1e-9, -1e-15, 0.0, 1e-15, 1e-9])
def test_faces_touching_with_an_offset(shift, gap):
    """Cubes face on face, B's moved sideways up to the last edge, touch where both faces are.

    Overlapping by less sideways than in height, they leave sideways.
    """
    boxes = Boxes(
        np.full((1, 3), 0.5),
        np.full((1, 3), 0.5),
        np.eye(3)[None],
        np.array([[shift, 0, 1 + gap]]),
    )
    answers = solve(boxes)
    assert answers.phi[0] == pytest.approx(max(gap, min(shift - 1.0, 0.0)), abs=3e-16)
    assert max(faults(boxes, answers).values()) <= 1e-15
