"""The border for poses: what is taken, what is refused, and how rotations are made exact."""

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.spatial.pose_kernels import (
    BAD_BOTTOM_ROW,
    FAR_AWAY,
    NOT_FINITE,
    NOT_ORTHONORMAL,
    REFLECTION,
    store_poses,
    VALID,
    world_poses,
    world_poses_of_children,
)
from scene_graph_ros.geometry.spatial.poses import (
    as_pose,
    as_poses,
    compose,
    identity,
    inverse,
    pose_from_xyz_rpy,
    poses_from_quaternions,
    quaternions_from_poses,
    rotation_from_rpy,
)
from scene_graph_ros.geometry.tolerances import (
    MAX_COORDINATE,
    QUATERNION_NORM_DEFECT,
    ROTATION_DEFECT,
    ROTATION_ROUNDING,
)

ANGLES = st.floats(-math.pi, math.pi)
COORDINATES = st.floats(-1e6, 1e6)


def rigid(seed: int) -> np.ndarray:
    """Return a pose whose rotation comes from a QR decomposition."""
    generator = np.random.default_rng(seed)
    Q, R = np.linalg.qr(generator.normal(size=(3, 3)))
    Q *= np.sign(np.diag(R))
    if np.linalg.det(Q) < 0.0:
        Q[:, 0] = -Q[:, 0]
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Q, generator.normal(size=3)
    return X


def defect(X: np.ndarray) -> float:
    """Return the largest entry of abs(R.T @ R - I)."""
    return float(np.abs(X[:3, :3].T @ X[:3, :3] - np.eye(3)).max())


class Matrix:
    """Something with as_matrix(), as in other libraries."""

    def __init__(self, X: np.ndarray) -> None:
        self.X = X

    def as_matrix(self) -> np.ndarray:
        """Return the matrix."""
        return self.X


def test_pose_exact_to_rounding_is_kept_bit_for_bit():
    """A rotation that is orthonormal to rounding comes back unchanged."""
    X = np.eye(4)
    X[:3, :3] = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]
    X[:3, 3] = [1.0 / 3.0, -2.0, 1e6]
    assert np.array_equal(as_pose(X, "X"), X)


def test_pose_is_copied_and_read_only():
    """Changing what was given changes nothing, and the result cannot be written to."""
    X = rigid(1)
    result = as_pose(X, "X")
    X[0, 3] = 99.0
    assert result[0, 3] != 99.0
    with pytest.raises(ValueError, match="read-only"):
        result[0, 0] = 0.0


@pytest.mark.parametrize("seed", range(10))
def test_nearly_rigid_pose_is_made_orthonormal(seed):
    """Noise below the accepted defect is removed, and moves the rotation no more than that."""
    exact = rigid(seed)
    noise = np.zeros((4, 4))
    noise[:3, :3] = np.random.default_rng(seed).uniform(-1.0, 1.0, (3, 3)) * ROTATION_DEFECT / 8.0
    result = as_pose(exact + noise, "X")
    assert defect(exact + noise) > 100.0 * ROTATION_ROUNDING
    assert defect(result) <= ROTATION_ROUNDING
    assert np.abs(result - exact).max() <= ROTATION_DEFECT


def test_float32_pose_is_accepted():
    """A pose that went through float32 is rigid to about 1e-7, and is made exact."""
    assert defect(as_pose(rigid(3).astype(np.float32), "X")) <= ROTATION_ROUNDING


def test_object_with_as_matrix_is_accepted():
    """Anything with as_matrix() stands for its matrix."""
    X = rigid(4)
    assert np.allclose(as_pose(Matrix(X), "X"), X, rtol=0.0, atol=1e-15)


def test_nested_lists_are_accepted():
    """A pose may be given as lists."""
    assert np.array_equal(as_pose(np.eye(4).tolist(), "X"), np.eye(4))


def bad_poses():
    """Name what is wrong, the pose, and the words of the error."""
    nan, far, shear, mirror, row = (rigid(5) for _ in range(5))
    nan[1, 3] = np.nan
    far[2, 3] = 2.0 * MAX_COORDINATE
    shear[0, 1] += 1e-3
    mirror[:3, 0] *= -1.0
    row[3, 3] = 2.0
    infinite = rigid(5)
    infinite[0, 0] = -np.inf
    return [
        ("nan", nan, "not finite"),
        ("infinite", infinite, "not finite"),
        ("far", far, "beyond 1e\\+12 m"),
        ("shear", shear, "not rigid"),
        ("scaled", 2.0 * np.eye(4) - np.diag((0.0, 0.0, 0.0, 1.0)), "not rigid"),
        ("zero rotation", np.diag((0.0, 0.0, 0.0, 1.0)), "not rigid"),
        ("mirror", mirror, "reflection"),
        ("last row", row, "last row"),
    ]


@pytest.mark.parametrize(("X", "words"), [case[1:] for case in bad_poses()])
def test_bad_pose_is_refused_by_name_and_value(X, words):
    """The error says which pose, what is wrong, and what came in."""
    with pytest.raises(InvalidPoseError, match=words) as caught:
        as_pose(X, "X_PG of geometry 'ball'")
    assert "X_PG of geometry 'ball'" in str(caught.value)
    assert "[[" in str(caught.value)


@pytest.mark.parametrize(
    "X", [np.eye(3), np.zeros((4, 3)), "pose", None, 1.0, [[1.0], [2.0, 3.0]], 1j * np.eye(4)]
)
def test_what_is_no_matrix_is_refused(X):
    """Another shape or type is refused with the same error class."""
    with pytest.raises(InvalidPoseError, match="pose X "):
        as_pose(X, "X")


def test_batch_names_the_bad_row():
    """A batch is refused with the row of the first bad pose."""
    X = np.array([rigid(i) for i in range(5)])
    X[3, 0, 3] = np.inf
    with pytest.raises(InvalidPoseError, match=r"X_PFs\[3\]"):
        as_poses(X, "X_PFs")


def test_batch_of_objects():
    """A list of poses of any kind becomes one array."""
    X = [rigid(1), Matrix(rigid(2))]
    assert np.allclose(as_poses(X, "X"), [rigid(1), rigid(2)], rtol=0.0, atol=1e-15)


def test_empty_batch():
    """No poses are a valid batch."""
    assert as_poses(np.empty((0, 4, 4)), "X").shape == (0, 4, 4)


def test_read_only_and_strided_input():
    """Views that kernels cannot read as they are give the same result."""
    X = np.array([rigid(i) for i in range(4)])
    X.setflags(write=False)
    assert np.array_equal(as_poses(X[::2], "X"), X[::2].copy())


@pytest.mark.parametrize("seed", range(5))
def test_inverse(seed):
    """X_BA X_AB is the identity for one pose and for a batch."""
    X = np.array([rigid(seed), rigid(seed + 100)])
    assert np.allclose(inverse(X) @ X, np.eye(4), rtol=0.0, atol=1e-14)
    assert np.array_equal(inverse(X[0]), inverse(X)[0])


def test_compose_is_the_matrix_product():
    """A product of poses is that of matrices, with an exact last row."""
    X_AB, X_BC = rigid(1), rigid(2)
    X_AC = compose(X_AB, X_BC)
    assert np.allclose(X_AC, X_AB @ X_BC, rtol=0.0, atol=1e-15)
    assert X_AC[3].tolist() == [0.0, 0.0, 0.0, 1.0]


def test_identity_is_read_only():
    """The shared identity cannot be changed."""
    with pytest.raises(ValueError, match="read-only"):
        identity()[0, 3] = 1.0


def test_quaternion_order_is_xyzw():
    """A quarter turn about z is (0, 0, sin 45, cos 45) and maps x to y."""
    half = math.sqrt(0.5)
    X = poses_from_quaternions([[1.0, 2.0, 3.0]], [[0.0, 0.0, half, half]])[0]
    assert np.allclose(X[:3, :3] @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], rtol=0.0, atol=1e-15)
    assert X[:3, 3].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 1, 1), (3, 2, 1)]
)
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, math.pi - 1e-9, math.pi, 3.5])
def test_quaternion_round_trip(axis, angle):
    """Quaternion to matrix and back is the same up to sign, also near half turns."""
    direction = np.array(axis) / np.linalg.norm(axis)
    q = np.append(direction * math.sin(angle / 2.0), math.cos(angle / 2.0))
    back = quaternions_from_poses(poses_from_quaternions(np.zeros((1, 3)), [q]))[0]
    assert min(np.abs(back - q).max(), np.abs(back + q).max()) < 4e-16
    assert back[3] >= 0.0


def test_quaternion_is_normalized():
    """A norm within the accepted defect is divided out."""
    q = np.array([[0.1, -0.2, 0.3, 0.9]])
    q *= (1.0 + 0.9 * QUATERNION_NORM_DEFECT) / np.linalg.norm(q)
    assert defect(poses_from_quaternions([[0.0, 0.0, 0.0]], q)[0]) <= ROTATION_ROUNDING


@pytest.mark.parametrize(
    ("p", "q", "words"),
    [
        ((0, 0, 0), (0, 0, 0, 0), "norm"),
        ((0, 0, 0), (0, 0, 0, 1.01), "norm"),
        ((0, 0, 0), (0, np.nan, 0, 1), "not finite"),
        ((0, np.inf, 0), (0, 0, 0, 1), "not finite"),
        ((0, 1e13, 0), (0, 0, 0, 1), "beyond"),
    ],
)
def test_bad_quaternion_is_refused_with_its_row(p, q, words):
    """The second row is bad; the error names it."""
    with pytest.raises(InvalidPoseError, match=words) as caught:
        poses_from_quaternions([(0, 0, 0), p], [(0, 0, 0, 1), q], "of message")
    assert "of message[1]" in str(caught.value)


def test_lengths_of_positions_and_quaternions_must_agree():
    """Two positions and one quaternion are refused."""
    with pytest.raises(InvalidPoseError, match="must be"):
        poses_from_quaternions(np.zeros((2, 3)), np.zeros((1, 4)))


@pytest.mark.parametrize(
    ("rpy", "image_of_x", "image_of_y"),
    [
        ((math.pi / 2, 0, 0), (1, 0, 0), (0, 0, 1)),
        ((0, math.pi / 2, 0), (0, 0, -1), (0, 1, 0)),
        ((0, 0, math.pi / 2), (0, 1, 0), (-1, 0, 0)),
        # Roll first turns y to z, which yaw leaves; x goes to y by yaw.
        ((math.pi / 2, 0, math.pi / 2), (0, 1, 0), (0, 0, 1)),
    ],
)
def test_rpy_is_fixed_axis(rpy, image_of_x, image_of_y):
    """Roll, pitch and yaw turn about the fixed x, y, z axes, in this order."""
    R = rotation_from_rpy(rpy)
    assert np.allclose(R[:, 0], image_of_x, rtol=0.0, atol=1e-15)
    assert np.allclose(R[:, 1], image_of_y, rtol=0.0, atol=1e-15)


@given(st.tuples(COORDINATES, COORDINATES, COORDINATES), st.tuples(ANGLES, ANGLES, ANGLES))
def test_pose_from_xyz_rpy_is_rigid(xyz, rpy):
    """Any angles give a pose that is rigid to rounding, at the given place."""
    X = pose_from_xyz_rpy(xyz, rpy)
    assert defect(X) <= ROTATION_ROUNDING
    assert X[:3, 3].tolist() == list(xyz)


@pytest.mark.parametrize(
    ("entry", "value", "status"),
    [
        ((0, 3), np.nan, NOT_FINITE),
        ((3, 0), np.inf, NOT_FINITE),
        ((1, 1), np.nan, NOT_FINITE),
        ((3, 3), 1.0 + 1e-5, BAD_BOTTOM_ROW),
        ((2, 3), -1e13, FAR_AWAY),
        ((0, 0), -1.0, REFLECTION),
        ((1, 2), 1e-5, NOT_ORTHONORMAL),
    ],
)
def test_one_bad_pose_among_many_is_found(entry, value, status):
    """Wherever it is among poses that are checked in step, it is named, and nothing is written."""
    for count in (1, 7, 8, 19):
        for bad in range(count):
            poses = np.tile(np.eye(4), (count, 1, 1))
            poses[(bad, *entry)] = value
            out = np.full((count, 4, 4), 7.0)
            assert store_poses(poses, np.arange(count), out) == (bad, status)
            assert (out == 7.0).all()


def test_one_rough_pose_among_many_is_made_rigid():
    """A rotation off by 1e-8 becomes orthonormal to rounding, those beside it stay as they are."""
    poses = np.tile(np.eye(4), (19, 1, 1))
    poses[:, :3, :3] = Rotation.random(19, random_state=1).as_matrix()
    rough = poses.copy()
    rough[11, 0, 1] += 1e-8
    out = np.empty_like(poses)
    assert store_poses(rough, np.arange(19)[::-1].copy(), out)[1] == VALID
    others = np.arange(19) != 7
    np.testing.assert_allclose(out[others], poses[::-1][others], rtol=0.0, atol=1e-15)
    R = out[7, :3, :3]
    np.testing.assert_allclose(R.T @ R, np.eye(3), rtol=0.0, atol=ROTATION_ROUNDING)
    np.testing.assert_allclose(R, poses[11, :3, :3], rtol=0.0, atol=1e-8)


def test_product_of_poses_is_that_of_matrices():
    """World poses down a chain of frames, and of geometries on them, are products of matrices."""
    X = np.tile(np.eye(4), (5, 1, 1))
    X[:, :3, :3] = Rotation.random(5, random_state=2).as_matrix()
    X[:, :3, 3] = np.arange(15.0).reshape(5, 3)
    X[0] = np.eye(4)
    X_WF, X_WG = np.empty_like(X), np.empty_like(X)
    world_poses(np.array([0, 0, 1, 2, 1]), X, X_WF)
    for i, parent in ((1, 0), (2, 1), (3, 2), (4, 1)):
        np.testing.assert_allclose(X_WF[i], X_WF[parent] @ X[i], rtol=1e-15, atol=1e-14)
    rows, frame = np.array([3, 0, 1, 2, 4]), np.array([4, 3, 2, 1, 0], dtype=np.int32)
    world_poses_of_children(rows, frame, X_WF, X, X_WG)
    np.testing.assert_allclose(X_WG, X_WF[frame] @ X, rtol=1e-15, atol=1e-13)
