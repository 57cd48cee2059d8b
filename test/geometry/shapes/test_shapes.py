"""The primitive shapes: their parameters, bounds and volumes."""

import copy
import math
import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Sphere
from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

# Class, field names, kind, half extents and volume for the parameters 1/3, 0.5, 0.7 (as many as
# there are), from the textbook formulas.
THIRD = 1.0 / 3.0
PARAMETERS = (THIRD, 0.5, 0.7)
CASES = [
    (Sphere, ("radius",), ShapeKind.SPHERE, (THIRD,) * 3, 4 / 3 * math.pi / 27),
    (
        Capsule,
        ("radius", "length"),
        ShapeKind.CAPSULE,
        (THIRD, THIRD, 0.25 + THIRD),
        math.pi / 9 * 0.5 + 4 / 3 * math.pi / 27,
    ),
    (Box, ("width", "depth", "height"), ShapeKind.BOX, (THIRD / 2, 0.25, 0.35), 0.35 / 3),
    (Cylinder, ("radius", "length"), ShapeKind.CYLINDER, (THIRD, THIRD, 0.25), math.pi / 18),
    (
        Ellipsoid,
        ("a", "b", "c"),
        ShapeKind.ELLIPSOID,
        (THIRD, 0.5, 0.7),
        4 / 3 * math.pi * 0.35 / 3,
    ),
]
FIELDS = [(case[0], i, field) for case in CASES for i, field in enumerate(case[1])]


@pytest.mark.parametrize(("shape_type", "fields", "kind", "half", "volume"), CASES)
def test_parameters_bounds_and_volume(shape_type, fields, kind, half, volume):
    """A shape keeps its parameters in order and knows its kind, box and volume."""
    shape = shape_type(*PARAMETERS[: len(fields)])
    assert [getattr(shape, field) for field in fields] == list(PARAMETERS[: len(fields)])
    assert shape.kind is kind
    lower, upper = shape.local_bounds()
    assert upper.tolist() == pytest.approx(half, rel=1e-15)
    assert (lower == -upper).all()
    assert shape.volume() == pytest.approx(volume, rel=1e-14)


@pytest.mark.parametrize(("shape_type", "index", "field"), FIELDS)
@pytest.mark.parametrize(
    "value",
    [0.0, -1.0, math.nan, math.inf, -math.inf, 1e-300, 1e-10, 1e10, 10**400, "1", None, True],
)
def test_bad_size_is_refused_by_name_and_value(shape_type, index, field, value):
    """Every size must be a positive, finite number of sane magnitude; a ball may be a point."""
    if shape_type is Sphere and value == 0.0:
        assert Sphere(value).radius == 0.0
        return
    count = sum(1 for case in FIELDS if case[0] is shape_type)
    arguments = [0.1] * count
    arguments[index] = value
    with pytest.raises(InvalidShapeError) as caught:
        shape_type(*arguments)
    message = str(caught.value)
    assert shape_type.__name__ in message
    assert f" {field} " in message
    assert repr(value)[:90] in message


@pytest.mark.parametrize(("shape_type", "fields"), [case[:2] for case in CASES])
def test_equality_hash_repr_and_copies(shape_type, fields):
    """Shapes with the same parameters are the same, also after copying and pickling."""
    shape = shape_type(*PARAMETERS[: len(fields)])
    other = shape_type(*[2.0 * value for value in PARAMETERS[: len(fields)]])
    assert shape != other
    for same in (
        shape_type(*PARAMETERS[: len(fields)]),
        copy.deepcopy(shape),
        pickle.loads(pickle.dumps(shape)),
    ):
        assert same == shape
        assert hash(same) == hash(shape)
    assert repr(shape).startswith(f"{shape_type.__name__}({fields[0]}=")


def test_shapes_of_different_kinds_are_different():
    """A capsule is not a cylinder with the same numbers."""
    assert Capsule(1.0, 2.0) != Cylinder(1.0, 2.0)


def test_shape_is_immutable():
    """A parameter cannot be changed."""
    with pytest.raises(AttributeError):
        Sphere(1.0).radius = 2.0


def test_numpy_and_integer_sizes_become_floats():
    """Whatever kind of number came in, a float is kept."""
    shape = Box(1, np.float32(0.5), np.int64(2))
    assert [type(size) for size in (shape.width, shape.depth, shape.height)] == [float] * 3


def test_box_size_and_cube():
    """The size of a box is its three lengths; a cube has one."""
    assert Box(1.0, 2.0, 3.0).size.tolist() == [1.0, 2.0, 3.0]
    assert Box.make_cube(0.3) == Box(0.3, 0.3, 0.3)


def test_half_space_has_no_bounds():
    """A half space is infinite and has no parameters."""
    lower, upper = HalfSpace().local_bounds()
    assert (lower == -np.inf).all()
    assert (upper == np.inf).all()
    assert HalfSpace().volume() == math.inf
    assert HalfSpace() == HalfSpace()
    assert HalfSpace().kind is ShapeKind.HALF_SPACE


DIRECTIONS = [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 2, 0), (0, -1, 0), (1, -2, 3), (1e-9, 1, 0)]


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e200])
def test_half_space_pose(direction, scale):
    """H's z axis is along the direction, the point is on its plane, and the pose is rigid."""
    p_FB = np.array([0.3, -0.2, 1.7])
    X_FH = HalfSpace.make_pose(scale * np.array(direction, dtype=float), p_FB)
    normal = np.array(direction) / np.linalg.norm(direction)
    assert np.allclose(X_FH[:3, 2], normal, rtol=0.0, atol=1e-15)
    assert np.allclose(X_FH[:3, :3].T @ X_FH[:3, :3], np.eye(3), rtol=0.0, atol=1e-15)
    assert np.linalg.det(X_FH[:3, :3]) > 0.0
    assert abs(normal @ (p_FB - X_FH[:3, 3])) < 1e-15
    assert np.allclose(np.cross(X_FH[:3, 3], normal), 0.0, rtol=0.0, atol=1e-15)


def test_half_space_pose_for_the_ground_is_the_identity():
    """Up, through the origin, changes nothing."""
    assert np.array_equal(HalfSpace.make_pose((0, 0, 1), (0, 0, 0)), np.eye(4))


@pytest.mark.parametrize("direction", [(0, 0, 0), (1e-11, 0, 0)])
def test_half_space_needs_a_direction(direction):
    """A vector too short to point anywhere is refused with its value."""
    with pytest.raises(InvalidShapeError, match="Hz_dir_F") as caught:
        HalfSpace.make_pose(direction, (0, 0, 0))
    assert repr(direction) in str(caught.value)


@pytest.mark.parametrize(
    ("direction", "point", "name"),
    [
        ((0, 0, np.nan), (0, 0, 0), "Hz_dir_F"),
        ((0, 0, 1), (0, np.inf, 0), "p_FB"),
        ((0, 1), (0, 0, 0), "Hz_dir_F"),
        ("up", (0, 0, 0), "Hz_dir_F"),
        ((0, 0, 1), ([0], 0, 0), "p_FB"),
    ],
)
def test_half_space_pose_needs_finite_vectors(direction, point, name):
    """The vector that is not three finite numbers is named."""
    with pytest.raises(InvalidShapeError, match=name):
        HalfSpace.make_pose(direction, point)
