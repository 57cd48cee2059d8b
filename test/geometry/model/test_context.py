"""Contexts: their poses, their own copy of the model, and their snapshots."""

import copy
import gc
import threading
import weakref

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    FrameId,
    GeometryFrame,
    GeometryInstance,
    IllustrationProperties,
    ProximityProperties,
    Role,
    SceneGraph,
    SourceId,
    Sphere,
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


def test_rows_are_sorted_by_id_and_tell_anchored_ones(world):
    """Columns of the proximity arrays agree with the inspector."""
    early = world.instance("early", proximity=True)
    world.instance("unused")
    graph = world.scene_graph
    graph.register_geometry(world.arm, world.link2, world.instance("late", proximity=True))
    graph.register_geometry(world.arm, world.link1, early)
    snapshot = graph.create_default_context().snapshot
    rows = snapshot.proximity
    assert rows.ids.tolist() == sorted(rows.ids.tolist())
    assert [int(i) for i in rows.geometry_ids] == rows.ids.tolist()
    assert len(rows.ids) == len(rows.table.kind) == 6
    for geometry_id, is_anchored in zip(rows.geometry_ids, rows.is_anchored, strict=True):
        assert is_anchored == (geometry_id == world.floor)
        assert snapshot.inspector.is_anchored(geometry_id) == is_anchored


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


def test_snapshot_is_the_same_until_something_changes(world):
    """Nothing new, no new snapshot; older snapshots keep what they had."""
    context = world.scene_graph.create_default_context()
    first = context.snapshot
    assert context.snapshot is first
    assert first.snapshot is first
    context.set_frame_pose(world.arm, world.link1, yaw(0.0, x=1.0))
    second = context.snapshot
    context.set_frame_pose(world.arm, world.link1, yaw(0.0, x=2.0))
    world.scene_graph.remove_geometry(world.other, world.crate, context=context)
    third = context.snapshot
    assert [s.pose_in_world(world.ball1)[0, 3] for s in (first, second, third)] == [0.0, 1.0, 2.0]
    assert [s.inspector.num_geometries() for s in (first, second, third)] == [4, 4, 3]
    assert len(second.X_WG) == 4
    assert first.model_version == second.model_version != third.model_version
    assert first.pose_version < second.pose_version < third.pose_version


def test_what_comes_out_of_a_snapshot_is_a_copy(world):
    """Writing to a returned pose does not move the frame."""
    snapshot = world.scene_graph.create_default_context().snapshot
    for pose in (
        snapshot.pose_in_world(world.link1),
        snapshot.pose_in_parent(world.link1),
        snapshot.pose_in_world(world.ball1),
    ):
        pose[:] = 7.0
    assert np.array_equal(snapshot.pose_in_world(world.link1), np.eye(4))
    assert np.array_equal(snapshot.pose_in_parent(world.link1), np.eye(4))


def test_what_if_leaves_the_snapshot_alone(world):
    """Frames of any source can be moved in the other snapshot; bad input is refused."""
    context = world.scene_graph.create_default_context()
    context.set_frame_pose(world.arm, world.link1, yaw(0.0, x=1.0))
    snapshot = context.snapshot
    poses = {world.link2: yaw(0.0, x=5.0), world.box_frame: yaw(0.0, y=3.0)}
    other = snapshot.with_frame_poses(poses)
    assert other.pose_in_world(world.ball2)[0, 3] == 6.0
    assert other.pose_in_world(world.crate)[1, 3] == 3.0
    assert snapshot.pose_in_world(world.ball2)[0, 3] == 1.0
    bad = np.full((4, 4), np.nan)
    with pytest.raises(InvalidPoseError, match="'link2'"):
        snapshot.with_frame_poses({world.link2: bad})
    with pytest.raises(UnknownIdError):
        snapshot.with_frame_poses({FrameId.get_new_id(): np.eye(4)})
    with pytest.raises(OwnershipError, match="world"):
        snapshot.with_frame_poses({world.scene_graph.world_frame_id(): np.eye(4)})


def test_unknown_ids_have_no_pose(world):
    """Frames and geometries that are not there are refused."""
    context = world.scene_graph.create_default_context()
    world.scene_graph.remove_geometry(world.other, world.crate, context=context)
    for attempt in (
        lambda: context.snapshot.pose_in_world(world.crate),
        lambda: context.snapshot.pose_in_world(FrameId.get_new_id()),
        lambda: context.snapshot.pose_in_parent(FrameId.get_new_id()),
        lambda: context.frame_pose(FrameId.get_new_id()),
        lambda: context.frame_poses(SourceId.get_new_id()),
    ):
        with pytest.raises(UnknownIdError):
            attempt()


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


def of_three_frames():
    """Return a context in which one source moves all three frames, and its id."""
    graph = SceneGraph()
    source = graph.register_source("source")
    for i in range(3):
        graph.register_frame(source, GeometryFrame(f"frame_{i}"))
    return graph.create_default_context(), source


def test_poses_that_somebody_looks_at_are_never_written_over():
    """A snapshot, its array or a part of that is enough to keep them as they are."""
    context, source = of_three_frames()
    held = []
    for i in range(30):
        context.set_frame_poses(source, np.tile(yaw(0.1 * i, x=i), (3, 1, 1)))
        snapshot = context.snapshot
        held.append((snapshot, snapshot.X_PF, snapshot.X_PF[:], None)[i % 4])
        del snapshot
    for i, one in enumerate(held):
        if one is not None:
            X_PF = one if isinstance(one, np.ndarray) else one.X_PF
            assert np.array_equal(X_PF[0], np.eye(4))
            assert X_PF[1:, 0, 3].tolist() == [i] * 3


def test_an_array_that_nobody_looks_at_is_used_again():
    """The memory of two arrays takes turns, also after poses that were refused."""
    context, source = of_three_frames()
    places = []
    for i in range(6):
        context.set_frame_poses(source, np.tile(yaw(0.1, x=i), (3, 1, 1)))
        places.append(context.snapshot.X_PF.ctypes.data)
    assert places[5] == places[3]
    assert places[4] == places[2] != places[5]
    with pytest.raises(InvalidPoseError):
        context.set_frame_poses(source, np.zeros((3, 4, 4)))
    assert context.snapshot.X_PF[1:, 0, 3].tolist() == [5.0] * 3
    for i in range(3):
        context.set_frame_poses(source, np.tile(yaw(0.1, x=i), (3, 1, 1)))
        assert context.snapshot.X_PF[1:, 0, 3].tolist() == [i] * 3


@pytest.mark.parametrize(
    ("X_FG", "order", "are_frames"),
    [
        (np.eye(4), (0, 1, 2), True),
        (yaw(0.0, x=1e-12), (0, 1, 2), False),
        (np.eye(4), (0, 2, 1), False),
        (np.eye(4), (0, 0, 1), False),
    ],
)
def test_geometries_on_frames_of_their_own_have_the_poses_of_these(X_FG, order, are_frames):
    """Poses in the world are right, and are the frames' own array where they are the same."""
    graph = SceneGraph()
    source = graph.register_source("source")
    frames = [graph.register_frame(source, GeometryFrame("frame_0"))]
    for i in (1, 2):
        frames.append(
            graph.register_frame(source, GeometryFrame(f"frame_{i}"), parent=frames[i - 1])
        )
    for i, k in enumerate(order):
        instance = GeometryInstance(X_FG, Sphere(0.1), f"ball_{i}")
        instance.set_proximity_properties(ProximityProperties())
        graph.register_geometry(source, frames[k], instance)
    context = graph.create_default_context()
    for turn in (0.3, 0.7):
        context.set_frame_poses(source, np.tile(yaw(turn, x=1.0), (3, 1, 1)))
        snapshot = context.snapshot
        expected = snapshot.X_WF[1:][list(order)] @ X_FG
        np.testing.assert_allclose(snapshot.X_WG, expected, rtol=0.0, atol=1e-15)
        assert np.shares_memory(snapshot.X_WG, snapshot.X_WF) == are_frames


def test_snapshots_are_released_at_once(world):
    """Without the garbage collector: a snapshot per update must not pile up."""
    context = world.scene_graph.create_default_context()
    gc.disable()
    try:
        snapshot = context.snapshot
        X_WG, place = weakref.ref(snapshot.X_WG), snapshot.X_WG.ctypes.data
        assert snapshot.inspector.num_geometries() == 4
        context.set_frame_pose(world.arm, world.link1, yaw(1.0))
        context.snapshot  # noqa: B018  # the context forgets the one before
        del snapshot
        assert X_WG() is None
        assert context.snapshot.X_WG.ctypes.data == place  # memory that nobody holds is used again
    finally:
        gc.enable()


def test_readers_never_see_half_an_update():
    """Two frames always move together; threads that read snapshots find them so."""
    graph = SceneGraph()
    source = graph.register_source("s")
    frames = [graph.register_frame(source, GeometryFrame(name)) for name in "ab"]
    context = graph.create_default_context()
    torn, all_read, stop = [], threading.Barrier(4, timeout=60.0), threading.Event()

    def read():
        assert np.array_equal(*context.snapshot.X_WF[1:3])
        all_read.wait()
        while not stop.is_set():
            X_WF = context.snapshot.X_WF
            if not np.array_equal(X_WF[1], X_WF[2]):
                torn.append(X_WF)

    readers = [threading.Thread(target=read) for _ in range(3)]
    for reader in readers:
        reader.start()
    all_read.wait()
    for step in range(500):
        X = yaw(0.0, x=float(step))
        context.set_frame_poses(source, np.array([X, X]))
        if step % 50 == 0:
            graph.register_frame(source, GeometryFrame(f"extra{step}"), context=context)
            extra = context.inspector().frames_for_source(source)[-1]
            graph.remove_frame(source, extra, context=context)
    stop.set()
    for reader in readers:
        reader.join()
    assert len(frames) == 2
    assert not torn
