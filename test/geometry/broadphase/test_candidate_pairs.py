from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.geometry.broadphase.all_pairs import all_candidate_pairs
from scene_graph_ros.geometry.broadphase.hierarchical_grid import candidate_pairs

_NO_FILTERS = np.zeros((0, 0), dtype=np.uint8)


def _half_space_poses(n, seed):
    """Return poses with normals of random directions, some of them along an axis."""
    rng = np.random.default_rng(seed)
    X = np.tile(np.eye(4), (n, 1, 1))
    for k in range(n):
        q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        if rng.random() < 0.5:
            X[k, :3, :3] = q
        X[k, :3, 3] = rng.uniform(-1, 1, 3)
    return X


def _both(lower, upper, margin=0.0, *, frame=None, half_space=None, bits=_NO_FILTERS, X=None):
    """Return the pairs found by the grid and by looking at all."""
    n = len(lower)
    arguments = (
        np.ascontiguousarray(lower, dtype=float),
        np.ascontiguousarray(upper, dtype=float),
        np.zeros(n, dtype=bool) if half_space is None else half_space,
        np.tile(np.eye(4), (n, 1, 1)) if X is None else X,
        np.arange(1, n + 1, dtype=np.int32) if frame is None else frame,
        bits,
        float(margin),
    )
    return candidate_pairs(*arguments), all_candidate_pairs(*arguments)


@st.composite
def _scenes(draw):
    """Draw boxes of many sizes, points, copies, half spaces, frames, filters and a margin."""
    n = draw(st.integers(0, 40))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    orders = draw(st.sampled_from([0.0, 1.0, 6.0, 12.0]))
    centre = rng.uniform(-1, 1, (n, 3)) + draw(st.sampled_from([0.0, 1e3, 1e6]))
    half = 0.3 * 10.0 ** -(orders * rng.random((n, 1))) * rng.random((n, 3))
    if draw(st.booleans()):  # on a lattice, so that faces touch exactly
        centre, half = np.round(2 * centre), np.round(2 * rng.random((n, 3))) / 2
    if n and draw(st.booleans()):
        copies = rng.integers(0, n, n)
        centre, half = centre[copies], half[copies]
    frame = rng.integers(0, draw(st.sampled_from([3, 1000])), n).astype(np.int32)
    half_space = rng.random(n) < draw(st.sampled_from([0.0, 0.2]))
    bits = _NO_FILTERS
    if n and draw(st.booleans()):
        matrix = rng.random((n, n)) < 0.2
        bits = np.packbits(matrix | matrix.T, axis=1, bitorder="little")
    margin = draw(st.sampled_from([0.0, 1e-9, 0.1, 1.0, 100.0]))
    lower, upper = centre - half, centre + half
    lower[half_space], upper[half_space] = -np.inf, np.inf
    return {
        "lower": lower,
        "upper": upper,
        "margin": margin,
        "frame": frame,
        "half_space": half_space,
        "bits": bits,
        "X": _half_space_poses(n, seed),
    }


@settings(max_examples=400, deadline=None)
@given(_scenes())
def test_grid_finds_the_same_pairs_as_looking_at_all(scene):
    """The same pairs in the same order, for any mixture of sizes, copies, margins and filters."""
    found, expected = _both(**scene)
    assert found.tolist() == expected.tolist()


def test_boxes_finer_than_their_coordinates_resolve_touch_few_cells():
    """Far from the origin, points and specks among large boxes are found, and nothing overruns."""
    rng = np.random.default_rng(11)
    for width in (0.0, 1e-15, 1e-12, 1e-9):
        lower = 1e6 + rng.uniform(0.0, 1e-9, (60, 3))
        upper = lower + width
        upper[0] = lower[0] + 1.0
        found, expected = _both(lower, upper)
        assert len(found) > 10
        assert found.tolist() == expected.tolist()


def test_all_pairs_is_what_it_says():
    """The oracle against a few lines of numpy: boxes, frames and filters."""
    rng = np.random.default_rng(7)
    lower = rng.random((30, 3))
    upper = lower + 0.3 * rng.random((30, 3))
    frame = rng.integers(0, 5, 30).astype(np.int32)
    matrix = rng.random((30, 30)) < 0.2
    matrix |= matrix.T
    bits = np.packbits(matrix, axis=1, bitorder="little")
    meets = ((lower[:, None] <= upper) & (lower <= upper[:, None])).all(axis=2)
    meets &= ~matrix & (frame[:, None] != frame)
    _, found = _both(lower, upper, frame=frame, bits=bits)
    assert len(found) > 5
    assert found.tolist() == np.argwhere(np.triu(meets, 1)).tolist()


def test_margin_is_the_euclidean_distance_of_boxes():
    """Unit boxes 3 and 4 apart along two axes are 5 apart: a margin of 5 finds them, 4.9 not."""
    lower = np.array([[0.0, 0, 0], [4.0, 5.0, 0.0]])
    for margin, count in ((5.0, 1), (4.999999, 0)):
        found, expected = _both(lower, lower + 1.0, margin)
        assert len(found) == len(expected) == count


def test_half_space_meets_boxes_below_its_plane_only():
    """A tilted floor is a candidate with the box that reaches it, not with the one above."""
    X = np.tile(np.eye(4), (3, 1, 1))
    X[0, :3, :3] = [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]  # normal (0.8, 0, 0.6)
    # Of a cube of side 0.2 around c, the lowest corner is at 0.8 c_x + 0.6 c_z - 0.14.
    centre = np.array([[0, 0, 0], [0.1, 0, 0.09], [0.1, 0, 0.11]])
    lower, upper = centre - 0.1, centre + 0.1
    lower[0], upper[0] = -np.inf, np.inf
    half_space = np.array([True, False, False])
    frame = np.array([0, 1, 1], dtype=np.int32)
    found, expected = _both(lower, upper, half_space=half_space, X=X, frame=frame)
    assert found.tolist() == expected.tolist() == [[0, 1]]


def test_unbounded_boxes_meet_everything():
    """A box without bounds that is no half space is a candidate with every other."""
    lower = np.array([[0.0, 0, 0], [-np.inf, -1, -1], [9.0, 0, 0]])
    upper = np.array([[1.0, 1, 1], [np.inf, 1, 1], [10.0, 1, 1]])
    found, expected = _both(lower, upper)
    assert found.tolist() == expected.tolist() == [[0, 1], [1, 2]]


@pytest.mark.parametrize("n", [0, 1, 2, 300])
def test_copies_in_one_place_all_meet(n):
    """Boxes with identical coordinates give every pair, sorted."""
    lower = np.full((n, 3), 1 / 3)
    found, _ = _both(lower, lower + 0.1)
    assert found.tolist() == np.argwhere(np.triu(np.ones((n, n), dtype=bool), 1)).tolist()


def test_few_huge_boxes_cost_a_look_each():
    """Floors under thousands of small boxes find each of them once."""
    rng = np.random.default_rng(11)
    centre = rng.uniform(0.0, 100.0, (3000, 3))
    half = np.full((3000, 3), 0.05)
    centre[:2, 2], half[:2] = 0.0, [200.0, 200.0, 50.0]
    found, expected = _both(centre - half, centre + half)
    assert np.array_equal(found, expected)
    assert len(found) > 2000
