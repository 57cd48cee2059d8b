"""Frames and geometry before they are registered."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    FrameId,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    GeometrySet,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
    Role,
    Sphere,
)
from scene_graph_ros.geometry.errors import (
    InvalidPoseError,
    InvalidShapeError,
    NameConflictError,
    RoleError,
    UnknownIdError,
)


def make(name="ball"):
    """Return an instance with some pose."""
    X_PG = np.eye(4)
    X_PG[:3, 3] = (0.1, 0.2, 0.3)
    return GeometryInstance(X_PG, Sphere(1.0 / 3.0), name)


def test_instance_has_what_it_was_given():
    """Pose, shape, name and a valid id; no roles."""
    instance = make()
    assert instance.pose()[:3, 3].tolist() == [0.1, 0.2, 0.3]
    assert instance.shape() == Sphere(1.0 / 3.0)
    assert instance.name() == "ball"
    assert instance.id().is_valid()
    assert instance.proximity_properties() is None
    assert instance.illustration_properties() is None
    assert instance.perception_properties() is None


def test_every_instance_has_its_own_id():
    """Two instances of the same thing are two things."""
    assert make().id() != make().id()


@pytest.mark.parametrize(
    ("given", "canonical"),
    [
        ("ball", "ball"),
        (" ball", "ball"),
        ("ball\t ", "ball"),
        ("\t my  ball \t", "my  ball"),
        ("my\tball", "my\tball"),
    ],
)
def test_names_are_trimmed(given, canonical):
    """Blanks at the ends go, blanks inside stay; the same for frames."""
    assert make(given).name() == canonical
    instance = make()
    instance.set_name(given)
    assert instance.name() == canonical
    assert GeometryFrame(given).name() == canonical


@pytest.mark.parametrize("name", ["", " ", "\t", " \t \t", None, 3])
def test_blank_names_are_refused(name):
    """Nothing but blanks is no name; the value is quoted."""
    for attempt in (
        lambda: make(name),
        lambda: GeometryFrame(name),
        lambda: make().set_name(name),
    ):
        with pytest.raises(NameConflictError) as caught:
            attempt()
        assert repr(name) in str(caught.value)


def test_bad_pose_names_the_geometry():
    """The error tells which geometry's pose is bad; a refused pose changes nothing."""
    X = np.eye(4)
    X[0, 0] = np.nan
    with pytest.raises(InvalidPoseError, match="X_PG of geometry 'ball'"):
        GeometryInstance(X, Sphere(1.0), "ball")
    instance = make()
    with pytest.raises(InvalidPoseError):
        instance.set_pose(X)
    assert instance.pose()[0, 3] == 0.1


def test_a_shape_is_needed():
    """Anything else is refused, with the geometry's name."""
    with pytest.raises(InvalidShapeError, match="'ball' needs a shape"):
        GeometryInstance(np.eye(4), "sphere", "ball")


def test_pose_and_shape_can_be_set():
    """Until it is registered, an instance may change."""
    instance = make()
    instance.set_pose(np.eye(4))
    instance.set_shape(Box(1.0, 2.0, 3.0))
    assert instance.pose()[0, 3] == 0.0
    assert instance.shape() == Box(1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("role", "properties_type"),
    [
        ("proximity", ProximityProperties),
        ("illustration", IllustrationProperties),
        ("perception", PerceptionProperties),
    ],
)
def test_role_properties(role, properties_type):
    """Properties are copied in; the instance's own may be changed; other roles' are refused."""
    instance, properties = make(), properties_type()
    properties.add_property("g", "x", 1)
    getattr(instance, f"set_{role}_properties")(properties)
    properties.add_property("g", "y", 2)
    own = getattr(instance, f"{role}_properties")()
    assert not own.has_property("g", "y")
    getattr(instance, f"mutable_{role}_properties")().add_property("g", "z", 3)
    assert own.get_property("g", "z") == 3
    assert instance.properties(Role[role.upper()]) is own
    wrong = IllustrationProperties() if role == "proximity" else ProximityProperties()
    with pytest.raises(RoleError, match="are not for"):
        getattr(instance, f"set_{role}_properties")(wrong)
    with pytest.raises(RoleError, match="a role needs"):
        getattr(instance, f"set_{role}_properties")({"x": 1})


def test_frame_has_name_group_and_id():
    """The group is 0 unless given."""
    assert GeometryFrame("f").frame_group() == 0
    assert GeometryFrame("f", 3).frame_group() == 3
    assert type(GeometryFrame("f", np.int64(3)).frame_group()) is int
    assert GeometryFrame("f").id() != GeometryFrame("f").id()


@pytest.mark.parametrize("group", [-1, 1.5, "a", True])
def test_bad_frame_group_is_refused(group):
    """A group is a non-negative integer."""
    with pytest.raises(ValueError, match="frame_group_id"):
        GeometryFrame("f", group)


def test_geometry_set_takes_ids_of_both_kinds():
    """Ids come one by one or in iterables, any number of times."""
    frame, ball, box = FrameId(1), GeometryId(2), GeometryId(3)
    geometry_set = GeometrySet(frame, [ball])
    geometry_set.add({box, ball})
    assert geometry_set.frame_ids() == {frame}
    assert geometry_set.geometry_ids() == {ball, box}
    copied = geometry_set.copy()
    copied.add(FrameId(9))
    assert geometry_set.frame_ids() == {frame}
    assert GeometrySet().geometry_ids() == frozenset()


@pytest.mark.parametrize("bad", [3, "ball", None, [3]])
def test_geometry_set_refuses_other_things(bad):
    """Only ids are members."""
    with pytest.raises(UnknownIdError, match="GeometrySet holds"):
        GeometrySet(bad)


def test_texts_for_people():
    """The texts of frames, instances and sets name what they are."""
    assert repr(GeometryFrame("f")) == "GeometryFrame('f')"
    assert repr(GeometryFrame("f", 2)) == "GeometryFrame('f', 2)"
    ball = make()
    ball.set_proximity_properties(ProximityProperties())
    assert repr(ball).startswith("GeometryInstance('ball', Sphere(radius=0.333")
    assert repr(ball).endswith(", PROXIMITY)")
    assert repr(GeometrySet(GeometryId(3), FrameId(2))) == "GeometrySet(FrameId(2), GeometryId(3))"
