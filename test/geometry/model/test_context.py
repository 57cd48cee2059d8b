"""Contexts: their poses, their own copy of the model, and their snapshots."""

import copy

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    FrameId,
    GeometryFrame,
    IllustrationProperties,
    ProximityProperties,
    Role,
    SourceId,
)
from scene_graph_ros.geometry.errors import InvalidPoseError, OwnershipError, UnknownIdError


def yaw(angle, x=0.0, y=0.0, z=0.0):
    """Return a turn about z, and a translation."""
    X = np.eye(4)
    X[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    X[:3, 3] = (x, y, z)
    return X


def test_frames_start_at_the_identity(world):
    """Before anything is set, every frame is where its parent is."""
    context = world.scene_graph.create_default_context()
    assert np.array_equal(context.snapshot.X_WF, np.tile(np.eye(4), (4, 1, 1)))


def test_poses_by_mapping_and_by_array_agree(world):
    """A mapping names frames; an array goes by the order of registration."""
    a, b = (world.scene_graph.create_default_context() for _ in range(2))
    X1, X2 = yaw(0.3, x=1.0), yaw(-0.7, z=2.0)
    a.set_frame_poses(world.arm, {world.link2: X2, world.link1: X1})
    b.set_frame_poses(world.arm, np.array([X1, X2]))
    assert np.array_equal(a.snapshot.X_PF, b.snapshot.X_PF)
    assert np.allclose(a.frame_poses(world.arm), [X1, X2], rtol=0.0, atol=1e-15)
    assert np.allclose(a.frame_pose(world.link2), X2, rtol=0.0, atol=1e-15)
    b.set_frame_poses(world.arm, [X2, X1])
    assert np.allclose(b.frame_poses(world.arm), [X2, X1], rtol=0.0, atol=1e-15)


def test_partial_update_keeps_the_other_poses(world):
    """Frames that are not named stay where they are."""
    context = world.scene_graph.create_default_context()
    context.set_frame_poses(world.arm, {world.link1: yaw(0.1), world.link2: yaw(0.2)})
    context.set_frame_pose(world.arm, world.link2, yaw(0.3))
    assert np.allclose(context.frame_pose(world.link1), yaw(0.1), rtol=0.0, atol=1e-15)
    context.set_frame_poses(world.arm, {})
    assert np.allclose(context.frame_pose(world.link2), yaw(0.3), rtol=0.0, atol=1e-15)


def test_world_poses_chain_through_parents(world):
    """A quarter turn and 1 along x, then 1 along the turned x: link2 is at (1, 1, 0)."""
    context = world.scene_graph.create_default_context()
    X = yaw(np.pi / 2, x=1.0), yaw(0.0, x=1.0)
    context.set_frame_poses(world.arm, np.array(X))
    context.set_frame_pose(world.other, world.box_frame, yaw(0.0, y=-3.0))
    child = world.scene_graph.register_geometry(
        world.arm, world.ball2, world.instance("c", X=yaw(0.0, z=0.5)), context=context
    )
    snapshot = context.snapshot
    for target, position in (
        (world.link2, (1.0, 1.0, 0.0)),
        (world.ball2, (1.0, 1.0, 0.0)),
        (child, (1.0, 1.0, 0.5)),
        (world.crate, (0.0, -3.0, 0.0)),
        (world.floor, (0.0, 0.0, 0.0)),
        (world.scene_graph.world_frame_id(), (0.0, 0.0, 0.0)),
    ):
        assert snapshot.pose_in_world(target)[:3, 3] == pytest.approx(position, abs=1e-15)
    assert np.allclose(snapshot.pose_in_parent(world.link2), X[1], rtol=0.0, atol=1e-15)
    rows = snapshot.proximity
    for row, geometry_id in enumerate(rows.geometry_ids):
        assert np.allclose(
            snapshot.X_WG[row], snapshot.pose_in_world(geometry_id), rtol=0.0, atol=1e-15
        )


@pytest.mark.parametrize("as_mapping", [True, False])
@pytest.mark.parametrize(
    ("entry", "words"), [(np.nan, "not finite"), (np.inf, "not finite"), (1e13, "beyond")]
)
def test_bad_pose_names_the_frame_and_changes_nothing(world, as_mapping, entry, words):
    """The second frame's pose is bad: the first one's is not taken either."""
    context = world.scene_graph.create_default_context()
    before, version = context.snapshot, context.pose_version
    bad = yaw(0.4)
    bad[0, 3] = entry
    given = {world.link1: yaw(0.4), world.link2: bad} if as_mapping else np.array([yaw(0.4), bad])
    with pytest.raises(InvalidPoseError, match=rf"X_PF of frame 'link2'.*{words}"):
        context.set_frame_poses(world.arm, given)
    assert context.pose_version == version
    assert context.snapshot is before
    assert np.array_equal(context.frame_pose(world.link1), np.eye(4))


@pytest.mark.parametrize("count", [0, 1, 3])
def test_wrong_number_of_poses_is_refused(world, count):
    """An array must have a pose for each frame of the source."""
    context = world.scene_graph.create_default_context()
    with pytest.raises(InvalidPoseError, match=rf"'arm' must be \(2, 4, 4\).*\({count}, 4, 4\)"):
        context.set_frame_poses(world.arm, np.tile(np.eye(4), (count, 1, 1)))
    with pytest.raises(InvalidPoseError, match="'arm'"):
        context.set_frame_poses(world.arm, np.eye(4))


def test_a_source_moves_only_its_own_frames(world):
    """Other sources' frames, the world and unknown frames are refused."""
    context = world.scene_graph.create_default_context()
    with pytest.raises(OwnershipError, match=r"'link1'.*belongs to source 'other': 'arm' cannot"):
        context.set_frame_poses(world.arm, {world.link1: yaw(1.0), world.box_frame: yaw(1.0)})
    with pytest.raises(OwnershipError):
        context.set_frame_pose(world.arm, world.scene_graph.world_frame_id(), np.eye(4))
    with pytest.raises(UnknownIdError, match="no frame"):
        context.set_frame_pose(world.arm, FrameId.get_new_id(), np.eye(4))
    with pytest.raises(UnknownIdError, match="no frame"):
        context.set_frame_poses(world.arm, {"link1": np.eye(4)})
    with pytest.raises(UnknownIdError, match="no source"):
        context.set_frame_pose(SourceId.get_new_id(), world.link1, np.eye(4))
    with pytest.raises(InvalidPoseError, match="'link1'"):
        context.set_frame_poses(world.arm, {world.link1: np.eye(3)})
    with pytest.raises(InvalidPoseError, match=r"'link1'.*one"):
        context.set_frame_poses(world.arm, {world.link1: np.array([np.eye(4)])})
    assert np.array_equal(context.frame_poses(world.arm), np.tile(np.eye(4), (2, 1, 1)))


def test_model_changes_do_not_reach_existing_contexts(world):
    """Every kind of change of the model leaves an existing context as it was."""
    graph = world.scene_graph
    context = graph.create_default_context()
    version = context.model_version
    graph.register_frame(world.arm, GeometryFrame("new"))
    graph.register_anchored_geometry(world.arm, world.instance("new"))
    graph.assign_role(world.arm, world.ball1, IllustrationProperties())
    graph.change_shape(world.arm, world.ball2, Box(1.0, 1.0, 1.0))
    graph.rename_geometry(world.arm, world.ball2, "other")
    graph.remove_source(world.other)
    inspector = context.inspector()
    assert context.model_version == version
    assert (inspector.num_frames(), inspector.num_geometries()) == (4, 4)
    assert inspector.num_geometries_with_role(Role.ILLUSTRATION) == 0
    assert inspector.get_shape(world.ball2) == world.instance().shape()
    assert inspector.get_name(world.ball2) == "ball"
    assert inspector.source_is_registered(world.other)


def test_context_changes_reach_neither_the_model_nor_other_contexts(world):
    """Each method with context= changes that context only."""
    graph = world.scene_graph
    context, other = graph.create_default_context(), graph.create_default_context()
    source = graph.register_source("late", context=context)
    frame = graph.register_frame(source, GeometryFrame("f"), context=context)
    child = graph.register_frame(source, GeometryFrame("c"), parent=frame, context=context)
    geometry = graph.register_geometry(source, child, world.instance("g"), context=context)
    anchored = graph.register_anchored_geometry(source, world.instance("a"), context=context)
    graph.assign_role(source, geometry, ProximityProperties(), context=context)
    graph.change_shape(source, anchored, Box(1.0, 1.0, 1.0), context=context)
    graph.rename_frame(source, frame, "renamed", context=context)
    graph.rename_geometry(source, geometry, "renamed", context=context)
    assert graph.remove_role(world.arm, world.link1, Role.PROXIMITY, context=context) == 1
    graph.remove_frame(world.other, world.box_frame, context=context)
    graph.remove_geometry(world.arm, world.ball1, context=context)
    graph.remove_source(world.other, context=context)
    inside = context.inspector()
    assert graph.source_is_registered(source, context=context)
    assert inside.get_name(frame) == inside.get_name(geometry) == "renamed"
    assert inside.get_roles(geometry) == {Role.PROXIMITY}
    assert inside.get_shape(anchored) == Box(1.0, 1.0, 1.0)
    assert not inside.source_is_registered(world.other)
    assert inside.get_all_geometry_ids() == [world.ball2, world.floor, geometry, anchored]
    for outside in (graph.model_inspector(), other.inspector()):
        assert not outside.source_is_registered(source)
        assert (outside.num_frames(), outside.num_geometries()) == (4, 4)
        assert outside.num_geometries_with_role(Role.PROXIMITY) == 4
    context.set_frame_poses(source, np.array([yaw(0.0, x=1.0), yaw(0.0, x=1.0)]))
    assert context.snapshot.pose_in_world(geometry)[0, 3] == 2.0
    graph.remove_source(source, context=context)
    assert not context.inspector().source_is_registered(source)


def test_poses_survive_changes_of_the_frames(world):
    """Adding and removing frames moves rows about, not frames."""
    graph = world.scene_graph
    context = graph.create_default_context()
    context.set_frame_poses(world.arm, np.array([yaw(0.1, x=1.0), yaw(0.2, x=2.0)]))
    context.set_frame_poses(world.other, np.array([yaw(0.3, x=3.0)]))
    graph.remove_frame(world.arm, world.link2, context=context)
    new = graph.register_frame(world.other, GeometryFrame("new"), context=context)
    assert np.allclose(context.frame_pose(world.link1), yaw(0.1, x=1.0), rtol=0.0, atol=1e-15)
    assert np.allclose(context.frame_pose(world.box_frame), yaw(0.3, x=3.0), rtol=0.0, atol=1e-15)
    assert np.array_equal(context.frame_pose(new), np.eye(4))
    assert context.snapshot.pose_in_world(world.crate)[0, 3] == 3.0
    with pytest.raises(UnknownIdError):
        context.frame_pose(world.link2)


def test_geometry_stays_on_its_frame_when_rows_shift(world):
    """Removing a frame without geometry moves the rows of the frames after it."""
    graph = world.scene_graph
    graph.remove_geometry(world.arm, world.ball2)
    context = graph.create_default_context()
    context.set_frame_pose(world.other, world.box_frame, yaw(0.0, x=3.0))
    crate = context.snapshot.proximity.geometry_ids.index(world.crate)
    assert context.snapshot.X_WG[crate, 0, 3] == 3.0
    graph.remove_frame(world.arm, world.link2, context=context)
    assert context.snapshot.X_WG[crate, 0, 3] == 3.0
    assert context.snapshot.proximity.frame[crate] == 2


def test_clones_are_independent(world):
    """A clone of a context or a scene graph starts equal and goes its own way."""
    graph = world.scene_graph
    context = graph.create_default_context()
    context.set_frame_pose(world.arm, world.link1, yaw(0.0, x=1.0))
    clone = context.clone()
    clone.set_frame_pose(world.arm, world.link1, yaw(0.0, x=2.0))
    graph.remove_geometry(world.arm, world.ball1, context=clone)
    assert context.frame_pose(world.link1)[0, 3] == 1.0
    assert context.inspector().num_geometries() == 4
    other = graph.clone()
    other.remove_source(world.arm)
    graph.remove_source(world.other)
    assert graph.model_inspector().get_all_source_ids()[1:] == [world.arm]
    assert other.model_inspector().get_all_source_ids()[1:] == [world.other]


def test_a_deep_copy_is_a_clone(world):
    """copy.deepcopy gives an independent scene graph or context with the same ids."""
    context = world.scene_graph.create_default_context()
    context.set_frame_pose(world.arm, world.link1, yaw(0.0, x=1.0))
    graph_copy, context_copy = copy.deepcopy((world.scene_graph, context))
    graph_copy.remove_source(world.arm)
    context_copy.set_frame_pose(world.arm, world.link1, yaw(0.0, x=2.0))
    assert world.inspector.source_is_registered(world.arm)
    assert not graph_copy.source_is_registered(world.arm)
    assert context.frame_pose(world.link1)[0, 3] == 1.0
    assert context_copy.frame_pose(world.link1)[0, 3] == 2.0
