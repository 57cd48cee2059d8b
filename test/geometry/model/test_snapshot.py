"""Snapshots: what is there at one moment, and nobody changes any more."""

import gc
import threading
import weakref

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    FrameId,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
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
