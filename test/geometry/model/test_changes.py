"""Roles, removal and alteration of what is registered."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    FrameId,
    GeometryFrame,
    GeometryId,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
    Role,
    RoleAssign,
    SceneGraph,
)
from scene_graph_ros.geometry.errors import (
    InvalidPoseError,
    InvalidShapeError,
    NameConflictError,
    OwnershipError,
    PropertyError,
    RoleError,
    UnknownIdError,
)

ALL_PROPERTIES = [ProximityProperties, IllustrationProperties, PerceptionProperties]


def with_value(properties_type, value):
    """Return properties that differ by a value."""
    properties = properties_type()
    properties.add_property("g", "x", value)
    return properties


@pytest.mark.parametrize("properties_type", ALL_PROPERTIES)
def test_role_is_assigned_once_and_replaced_after(world, properties_type):
    """NEW needs the absence of the role, REPLACE its presence."""
    graph, role = world.scene_graph, properties_type.role
    ball = graph.register_geometry(world.arm, world.link1, world.instance("new"))
    with pytest.raises(RoleError, match=rf"'new'.*no role {role.name} that could be replaced"):
        graph.assign_role(world.arm, ball, with_value(properties_type, 1), RoleAssign.REPLACE)
    graph.assign_role(world.arm, ball, with_value(properties_type, 2))
    with pytest.raises(RoleError, match=rf"'new'.*has role {role.name} already"):
        graph.assign_role(world.arm, ball, with_value(properties_type, 3))
    assert world.inspector.get_properties(ball, role).get_property("g", "x") == 2
    graph.assign_role(world.arm, ball, with_value(properties_type, 4), RoleAssign.REPLACE)
    assert world.inspector.get_properties(ball, role).get_property("g", "x") == 4
    assert world.inspector.get_roles(ball) == {role}


def test_assigned_properties_are_copied(world):
    """Changing the properties afterwards does not change the geometry's."""
    properties = ProximityProperties()
    ball = world.scene_graph.register_geometry(world.arm, world.link1, world.instance("new"))
    world.scene_graph.assign_role(world.arm, ball, properties)
    properties.add_property("g", "x", 1)
    assert not world.inspector.get_proximity_properties(ball).has_group("g")


def test_assigning_needs_ownership_properties_and_a_free_name(world):
    """Each rule is refused with its own error, and nothing has changed after."""
    graph = world.scene_graph
    twin = graph.register_geometry(world.arm, world.link1, world.instance("ball"))
    with pytest.raises(NameConflictError, match="named 'ball' with role PROXIMITY"):
        graph.assign_role(world.arm, twin, ProximityProperties())
    graph.assign_role(world.arm, twin, IllustrationProperties())
    with pytest.raises(OwnershipError, match=r"'ball'.*belongs to source 'arm', not to 'other'"):
        graph.assign_role(world.other, twin, PerceptionProperties())
    with pytest.raises(RoleError, match="a role needs"):
        graph.assign_role(world.arm, twin, "proximity")
    with pytest.raises(RoleError, match="RoleAssign"):
        graph.assign_role(world.arm, twin, PerceptionProperties(), "new")
    with pytest.raises(UnknownIdError, match="no geometry"):
        graph.assign_role(world.arm, GeometryId.get_new_id(), ProximityProperties())
    bad = ProximityProperties()
    bad.add_property("mesh", "representation", "voxels")
    with pytest.raises(PropertyError, match="voxels"):
        graph.assign_role(world.arm, world.ball2, bad, RoleAssign.REPLACE)
    assert world.inspector.get_roles(twin) == {Role.ILLUSTRATION}


def test_removing_a_role(world):
    """The count is 1 where the role was there, else 0; the name is free again."""
    graph = world.scene_graph
    assert graph.remove_role(world.arm, world.ball1, Role.ILLUSTRATION) == 0
    assert graph.remove_role(world.arm, world.ball1, Role.UNASSIGNED) == 0
    assert graph.remove_role(world.arm, world.ball1, Role.PROXIMITY) == 1
    assert graph.remove_role(world.arm, world.ball1, Role.PROXIMITY) == 0
    assert world.inspector.get_roles(world.ball1) == set()
    assert world.inspector.num_geometries_with_role(Role.UNASSIGNED) == 1
    graph.register_geometry(world.arm, world.link1, world.instance("ball", proximity=True))
    with pytest.raises(NameConflictError):
        graph.assign_role(world.arm, world.ball1, ProximityProperties())


def test_removing_a_role_from_a_frame(world):
    """All the source's geometries on the frame lose it; other sources' stay."""
    graph, world_frame = world.scene_graph, world.scene_graph.world_frame_id()
    theirs = graph.register_anchored_geometry(world.other, world.instance("w", proximity=True))
    graph.register_anchored_geometry(world.arm, world.instance("x"))
    assert graph.remove_role(world.arm, world_frame, Role.PROXIMITY) == 1
    assert world.inspector.get_roles(world.floor) == set()
    assert world.inspector.get_roles(theirs) == {Role.PROXIMITY}
    with pytest.raises(OwnershipError):
        graph.remove_role(world.other, world.link1, Role.PROXIMITY)
    with pytest.raises(OwnershipError):
        graph.remove_role(world.other, world.ball1, Role.PROXIMITY)


def test_removing_a_geometry_removes_what_hangs_on_it(world):
    """A branch goes as a whole; siblings stay."""
    graph = world.scene_graph
    child = graph.register_geometry(
        world.arm, world.ball1, world.instance("child", proximity=True)
    )
    leaf = graph.register_geometry(world.arm, child, world.instance("leaf"))
    sibling = graph.register_geometry(world.arm, world.ball1, world.instance("sibling"))
    graph.remove_geometry(world.arm, child)
    for gone in (child, leaf):
        with pytest.raises(UnknownIdError, match="no geometry"):
            world.inspector.get_name(gone)
    assert world.inspector.get_geometries(world.link1) == [world.ball1, sibling]
    graph.remove_geometry(world.arm, world.ball1)
    assert world.inspector.num_geometries_for_frame(world.link1) == 0
    graph.register_geometry(world.arm, world.link1, world.instance("ball", proximity=True))


def test_removing_a_frame_removes_what_is_below(world):
    """Frames and geometries below go; names are free again; other sources are untouched."""
    graph = world.scene_graph
    graph.remove_frame(world.arm, world.link1)
    assert world.inspector.frames_for_source(world.arm) == []
    assert world.inspector.get_all_geometry_ids() == [world.floor, world.crate]
    assert world.inspector.get_child_frames(graph.world_frame_id()) == [world.box_frame]
    again = graph.register_frame(world.arm, GeometryFrame("link1"))
    assert world.inspector.frames_for_source(world.arm) == [again]


def test_removing_a_source_removes_everything_of_it(world):
    """Frames, moving and anchored geometry; the name is free again."""
    graph = world.scene_graph
    theirs = graph.register_anchored_geometry(world.other, world.instance("theirs"))
    graph.remove_source(world.arm)
    assert world.inspector.get_all_geometry_ids() == [world.crate, theirs]
    assert world.inspector.get_all_frame_ids() == [graph.world_frame_id(), world.box_frame]
    assert not graph.source_is_registered(world.arm)
    with pytest.raises(UnknownIdError):
        world.inspector.frames_for_source(world.arm)
    assert graph.register_source("arm") != world.arm


def test_removal_needs_ownership(world):
    """A source removes only what is its own, and nobody removes the world."""
    graph = world.scene_graph
    with pytest.raises(OwnershipError):
        graph.remove_geometry(world.other, world.ball1)
    with pytest.raises(OwnershipError):
        graph.remove_frame(world.other, world.link2)
    with pytest.raises(OwnershipError, match="world frame"):
        graph.remove_frame(world.arm, graph.world_frame_id())
    internal = world.inspector.get_all_source_ids()[0]
    with pytest.raises(OwnershipError, match="world frame"):
        graph.remove_source(internal)
    with pytest.raises(UnknownIdError):
        graph.remove_frame(world.arm, FrameId.get_new_id())
    assert world.inspector.num_geometries() == 4


def test_changing_the_shape_keeps_pose_roles_and_filters(world):
    """Only the shape is another."""
    world.scene_graph.change_shape(world.arm, world.ball1, Box(1.0, 2.0, 3.0))
    assert world.inspector.get_shape(world.ball1) == Box(1.0, 2.0, 3.0)
    assert world.inspector.get_roles(world.ball1) == {Role.PROXIMITY}
    assert np.array_equal(world.inspector.get_pose_in_frame(world.ball1), np.eye(4))


def test_changing_shape_and_pose_moves_what_hangs_on_it(world):
    """X_PG of the child stays, its X_FG follows; a child's own new pose is in its frame."""
    graph = world.scene_graph
    child = graph.register_geometry(
        world.arm, world.ball1, world.instance("child", X=world.translation(x=1.0))
    )
    leaf = graph.register_geometry(
        world.arm, child, world.instance("leaf", X=world.translation(x=1.0))
    )
    graph.change_shape(world.arm, world.ball1, Box(1.0, 1.0, 1.0), world.translation(y=2.0))
    assert world.inspector.get_pose_in_frame(leaf)[:3, 3].tolist() == [2.0, 2.0, 0.0]
    assert world.inspector.get_pose_in_parent(leaf)[:3, 3].tolist() == [1.0, 0.0, 0.0]
    graph.change_shape(world.arm, child, Box(1.0, 1.0, 1.0), world.translation(z=7.0))
    assert world.inspector.get_pose_in_parent(child)[:3, 3].tolist() == [0.0, -2.0, 7.0]
    assert world.inspector.get_pose_in_frame(leaf)[:3, 3].tolist() == [1.0, 0.0, 7.0]


def test_bad_changes_of_shape_are_refused(world):
    """What is no shape, no pose or not one's own changes nothing."""
    graph = world.scene_graph
    with pytest.raises(InvalidShapeError, match="'ball'"):
        graph.change_shape(world.arm, world.ball1, None)
    with pytest.raises(InvalidPoseError, match="X_FG of geometry 'ball'"):
        graph.change_shape(world.arm, world.ball1, Box(1.0, 1.0, 1.0), np.zeros((4, 4)))
    with pytest.raises(OwnershipError):
        graph.change_shape(world.other, world.ball1, Box(1.0, 1.0, 1.0))
    assert world.inspector.get_shape(world.ball1) == world.instance().shape()


def test_renaming_a_frame(world):
    """The new name is trimmed, must be free, and is found; the old one is free."""
    graph = world.scene_graph
    graph.rename_frame(world.arm, world.link1, " base ")
    assert world.inspector.get_frame_id_by_name(world.arm, "base") == world.link1
    with pytest.raises(NameConflictError, match="named 'base'"):
        graph.rename_frame(world.arm, world.link2, "base")
    graph.rename_frame(world.arm, world.link2, "link1")
    graph.rename_frame(world.arm, world.link2, "link1")
    with pytest.raises(OwnershipError):
        graph.rename_frame(world.other, world.link2, "x")
    with pytest.raises(OwnershipError, match="world"):
        graph.rename_frame(world.arm, graph.world_frame_id(), "x")
    with pytest.raises(NameConflictError, match="empty"):
        graph.rename_frame(world.arm, world.link2, "  ")


def test_renaming_a_geometry(world):
    """The new name must be free for each role on its frame."""
    graph = world.scene_graph
    second = graph.register_geometry(world.arm, world.link1, world.instance("b", proximity=True))
    with pytest.raises(NameConflictError, match="'ball'"):
        graph.rename_geometry(world.arm, second, "ball")
    graph.rename_geometry(world.arm, world.ball1, "\tbase")
    graph.rename_geometry(world.arm, world.ball1, "base")
    graph.rename_geometry(world.arm, second, "ball")
    by_name = world.inspector.get_geometry_id_by_name
    assert by_name(world.link1, Role.PROXIMITY, "base") == world.ball1
    assert by_name(world.link1, Role.PROXIMITY, "ball") == second
    with pytest.raises(OwnershipError):
        graph.rename_geometry(world.other, second, "x")


def test_world_frame_is_the_same_everywhere():
    """Two scene graphs have the same id for the world."""
    assert SceneGraph().world_frame_id() == SceneGraph.world_frame_id()


def test_a_frame_hangs_on_another_ones_frame():
    """With its pose in it and all below it; whose it is, it stays. It is removed with that."""
    scene_graph = SceneGraph()
    thing, robot = (scene_graph.register_source(name) for name in ("thing", "robot"))
    cup = scene_graph.register_frame(thing, GeometryFrame("cup"))
    lid = scene_graph.register_frame(thing, GeometryFrame("lid"), parent=cup)
    hand = scene_graph.register_frame(robot, GeometryFrame("hand"))
    context = scene_graph.create_default_context()
    X = [np.eye(4) for _ in range(3)]
    for axis, pose in enumerate(X):
        pose[axis, 3] = 1.0
    scene_graph.change_parent(thing, cup, hand, context=context)
    context.set_frame_poses(thing, np.array(X[:2]))
    context.set_frame_poses(robot, np.array(X[2:]))
    inspector = context.inspector()
    assert inspector.get_parent_frame(cup) == hand
    assert inspector.get_child_frames(hand) == [cup]
    assert inspector.frames_for_source(thing) == [cup, lid]
    assert inspector.get_owning_source_name(cup) == "thing"
    np.testing.assert_array_equal(context.snapshot.pose_in_world(lid), X[2] @ X[0] @ X[1])
    # Another context's model is as it was.
    assert scene_graph.model_inspector().get_parent_frame(cup) != hand
    with pytest.raises(OwnershipError, match="cup"):
        scene_graph.change_parent(robot, cup, hand, context=context)
    with pytest.raises(NameConflictError, match="'cup' cannot hang on 'lid'"):
        scene_graph.change_parent(thing, cup, lid, context=context)
    with pytest.raises(OwnershipError, match="world"):
        scene_graph.change_parent(thing, inspector.world_frame_id(), hand, context=context)
    scene_graph.remove_frame(robot, hand, context=context)
    assert inspector.frames_for_source(thing) == []
