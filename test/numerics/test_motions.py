"""What must not change, or only a little, when poses change."""

from hard_corpus.batches import solve
from hard_corpus.constructed import BODIES, constructed, random_pose, SIZE
from hard_corpus.sites import pose
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry.spatial.poses import as_pose

CONVEX = {name: body for name, body in BODIES.items() if "triangles" not in name}
TOLERANCE = 1e-12 * SIZE


def random_cases(count, seed, reach=0.12):
    """Return constructed cases whose B is moved to a random place near A: deep to apart."""
    rng = np.random.default_rng(seed)
    base = constructed(0.0, bodies=CONVEX, rolls=(0.7,))
    found = []
    for row in rng.integers(0, len(base), count):
        X_WA = random_pose(rng)
        X_AB = random_pose(rng, reach)
        found.append(base[row]._replace(X_WA=X_WA, X_WB=X_WA @ X_AB, truth=np.nan))
    return found


def test_rigid_motion_of_the_scene():
    """The same pair seen from elsewhere has the same distance, witnesses and normal."""
    rng = np.random.default_rng(2)
    cases = random_cases(1500, 11)
    moved = []
    for case in cases:
        X_VW = random_pose(rng, 3.0)
        moved.append(case._replace(X_WA=X_VW @ case.X_WA, X_WB=X_VW @ case.X_WB))
    one, two = solve(cases), solve(moved)
    # Positions of up to 5 m are rounded by 1e-15 m in both scenes.
    error = np.abs(one.distance - two.distance)
    assert error.max() <= 20e-15 + TOLERANCE, cases[error.argmax()]
    n_one = np.array([c.X_WA[:3, :3].T @ n for c, n in zip(cases, one.nhat_BA_W, strict=True)])
    n_two = np.array([c.X_WA[:3, :3].T @ n for c, n in zip(moved, two.nhat_BA_W, strict=True)])
    settled = one.unique & (np.abs(one.distance) > 1e-3)
    off = np.abs(n_one - n_two).max(axis=1) * settled
    assert np.count_nonzero(off > 1e-9) <= 0.01 * len(cases)  # nearly equal depths may be swapped


def test_distance_is_lipschitz():
    """Moving B by 1e-9 m, turning included, changes the distance by no more than that."""
    rng = np.random.default_rng(4)
    cases = random_cases(2000, 12) + constructed(0.0, bodies=CONVEX)
    cases += constructed(1e-9, bodies=CONVEX, rolls=(0.0,))
    moved = []
    for case in cases:
        step = rng.normal(size=3)
        X_WB = case.X_WB.copy()
        X_WB[:3, 3] += 1e-9 * step / np.linalg.norm(step)
        moved.append(case._replace(X_WB=X_WB))
    one, two = solve(cases), solve(moved)
    length = np.array(
        [np.linalg.norm(b.X_WB[:3, 3] - a.X_WB[:3, 3]) for a, b in zip(cases, moved, strict=True)]
    )
    excess = np.abs(two.distance - one.distance) - length
    # What is left is the rounding of positions of a metre, in two answers.
    assert excess.max() <= 4e-15, cases[excess.argmax()].label


def test_distance_is_continuous_through_contact():
    """On the way from 3 cm apart to 6 cm deep the distance changes by no more than the way."""
    rng = np.random.default_rng(6)
    steps = np.concatenate(
        [np.linspace(0.03, -0.06, 46), [1e-6, 1e-9, 1e-12, 0.0, -1e-12, -1e-9, -1e-6]]
    )
    steps = np.sort(steps)[::-1]
    base = constructed(0.0, bodies=CONVEX, rolls=(0.7,))
    chosen = [base[row] for row in rng.integers(0, len(base), 120)]
    cases = []
    for case in chosen:
        n_W = case.nhat_BA_W
        slip = np.cross(n_W, rng.normal(size=3)) * 0.3
        for s in steps:
            X_WB = case.X_WB.copy()
            X_WB[:3, 3] -= s * n_W + (0.03 - s) * slip
            cases.append(case._replace(X_WB=X_WB))
    answers = solve(cases)
    for k, case in enumerate(chosen):
        rows = slice(k * len(steps), (k + 1) * len(steps))
        positions = np.array([c.X_WB[:3, 3] for c in cases[rows]])
        way = np.linalg.norm(np.diff(positions, axis=0), axis=1)
        change = np.abs(np.diff(answers.distance[rows]))
        assert (change - way).max() <= 4e-15, case.label


@pytest.mark.parametrize("distance", [1e-3, 1e-6])
def test_normal_is_continuous_through_contact(distance):
    """Just apart and just overlapping, the normal is the one of a flat or round side."""
    flat_or_round = ("face", "side", "smooth", "cap", "flat", "tip")

    def chosen(d):
        return {
            case.label: case
            for case in constructed(d, bodies=CONVEX, rolls=(0.7,))
            if case.label.split(" / ")[0].split(" ", 1)[1] in flat_or_round
        }

    apart, deep = chosen(distance), chosen(-distance)
    labels = sorted(set(apart) & set(deep))
    assert len(labels) > 200
    for cases in (apart, deep):
        answers = solve([cases[label] for label in labels])
        error = np.abs(answers.nhat_BA_W - [cases[label].nhat_BA_W for label in labels])
        # Positions are rounded by some 1e-16 m: over the distance, that turns the normal.
        assert error.max() <= 1e-15 / distance + 1e-12, labels[error.max(axis=1).argmax()]


def test_rotations_off_by_1e_9():
    """A rotation scaled and sheared by 1e-9 is made orthonormal; the answer moves that little."""
    rng = np.random.default_rng(8)
    cases = random_cases(300, 13)
    repaired = []
    for case in cases:
        X_WB = case.X_WB.copy()
        X_WB[:3, :3] = X_WB[:3, :3] @ (np.eye(3) + 1e-9 * rng.uniform(-1.0, 1.0, (3, 3)))
        X_WB = as_pose(X_WB, "X_WB")
        assert np.abs(X_WB[:3, :3].T @ X_WB[:3, :3] - np.eye(3)).max() <= 1e-15
        repaired.append(case._replace(X_WB=X_WB))
    one, two = solve(cases), solve(repaired)
    # A turn by 1e-9 per axis pair moves no point of a 20 cm body by more than sqrt(3) 0.2e-9 m.
    far = np.sqrt(3.0) * 2.0
    assert np.abs(one.distance - two.distance).max() <= far * 1e-9 * SIZE


def test_quaternion_off_by_1e_9_is_the_same_rotation():
    """A quaternion's length does not matter."""
    q = Rotation.from_euler("xyz", [0.3, -0.5, 0.7]).as_quat()
    for factor in (1.0 - 1e-9, 1.0 + 1e-9):
        R = Rotation.from_quat(q * factor).as_matrix()
        X = as_pose(pose(R, [1.0, 2.0, 3.0]), "X")
        assert np.abs(X[:3, :3] - Rotation.from_quat(q).as_matrix()).max() <= 1e-15
