"""Validation of poses, and the world's snapshots, without any node."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from msg_adapters.poses import PoseBatch
from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import NameConflictError, OwnershipError, UnknownIdError
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, SourceFrames, Statistics, UNSTAMPED
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

NOW = 1_000_000_000_000
LIMITS = TimeLimits(now=NOW, max_age=5_000_000_000, max_lead=1_000_000_000)


def translation(x):
    """Return a pose at x."""
    X = np.eye(4)
    X[0, 3] = x
    return X


def frames(*names):
    """Return frames at the identity, children of the world."""
    count = len(names)
    return SourceFrames(
        source="arm",
        ids=tuple(range(count)),
        names=names,
        parents=("world",) * count,
        X_PF=np.tile(np.eye(4), (count, 1, 1)),
        stamps=np.full(count, UNSTAMPED),
        foreign={"cup": "table"},
    )


def batch(names, xs, stamps):
    """Return a batch of poses at the given x."""
    X_PF = np.array([translation(x) for x in xs]).reshape(-1, 4, 4)
    parents = ("",) * len(names)
    return PoseBatch(tuple(names), parents, np.array(stamps, dtype=np.int64), X_PF, ())


@pytest.fixture
def warnings():
    """Warnings so far."""
    return []


@pytest.fixture
def intake(warnings):
    """The intake of source arm."""
    return Intake("arm", warnings.append)


def test_each_pose_is_judged_for_itself(intake, warnings):
    """Of five poses the two good ones are written, the others counted by their reasons."""
    own = frames("a", "b", "c")
    own.stamps[2] = NOW
    names = ("b", "ghost", "cup", "c", "a")
    stamps = [NOW - 1, NOW, NOW, NOW - 1, NOW - 2]
    assert intake.accept(batch(names, [1, 2, 3, 4, 5], stamps), own, LIMITS) == 2
    assert own.X_PF[:, 0, 3].tolist() == [5.0, 1.0, 0.0]
    assert own.stamps.tolist() == [NOW - 2, NOW - 1, NOW]
    assert intake.statistics.faults == {
        Fault.UNKNOWN_FRAME: 1,
        Fault.WRONG_SOURCE: 1,
        Fault.OUT_OF_ORDER: 1,
    }
    assert any("'table'" in warning and "'cup'" in warning for warning in warnings)


@pytest.mark.parametrize(
    ("stamp", "fault"),
    [
        (NOW - LIMITS.max_age, None),
        (NOW - LIMITS.max_age - 1, Fault.STALE),
        (NOW + LIMITS.max_lead, None),
        (NOW + LIMITS.max_lead + 1, Fault.FUTURE),
        (0, None),
    ],
)
def test_limits_of_time_are_inclusive(intake, stamp, fault):
    """Exactly at the limit a pose is taken; beyond it is not."""
    own = frames("a")
    assert intake.accept(batch(["a"], [1.0], [stamp]), own, LIMITS) == (fault is None)
    assert dict(intake.statistics.faults) == ({} if fault is None else {fault: 1})


def test_before_simulated_time_begins_only_the_order_counts(intake):
    """At time zero nothing is stale or from the future."""
    own = frames("a")
    limits = LIMITS._replace(now=0)
    assert intake.accept(batch(["a"], [1.0], [50]), own, limits) == 1
    assert intake.accept(batch(["a"], [2.0], [49]), own, limits) == 0
    assert own.X_PF[0, 0, 3] == 1.0


def test_a_warning_comes_once_per_reason_and_frame(intake, warnings):
    """A hundred bad messages are counted a hundred times and warned about once each."""
    own = frames("a")
    for _ in range(100):
        intake.accept(batch(["ghost", "spirit"], [0, 0], [NOW, NOW]), own, LIMITS)
    assert intake.statistics.faults[Fault.UNKNOWN_FRAME] == 200
    assert len(warnings) == 2


def test_the_rate_is_that_of_the_last_two_seconds():
    """100 messages in one second, then silence: 50 per second, later none."""
    statistics = Statistics()
    for i in range(100):
        statistics.arrived(i * 10_000_000)
    assert statistics.rate(1_000_000_000) == pytest.approx(50.0)
    assert statistics.rate(10_000_000_000) == 0.0


@pytest.fixture
def world():
    """A world with a ball on a frame of source arm."""
    scene_graph = SceneGraph()
    arm = scene_graph.register_source("arm")
    link = scene_graph.register_frame(arm, GeometryFrame("link"))
    ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
    ball.set_proximity_properties(ProximityProperties())
    scene_graph.register_geometry(arm, link, ball)
    return World(scene_graph)


def move(world, x, stamp):
    """Move the link as the node does."""
    with world.lock:
        own = world.frames("arm")
        own.X_PF[0, 0, 3] = x
        own.stamps[0] = stamp
        return world.commit({"arm"}, None)


def x_of(snapshot):
    """Return where the ball is in a snapshot."""
    return snapshot.query.snapshot.X_WG[0, 0, 3]


def test_a_snapshot_never_changes(world):
    """Later poses and edits are in later snapshots only."""
    first = world.snapshot
    second = move(world, 2.0, 10)
    world.edit(lambda edit: edit.add_source("other", token=1))
    assert (x_of(first), x_of(second), x_of(world.snapshot)) == (0.0, 2.0, 2.0)
    assert (first.stamp, second.stamp, world.snapshot.stamp) == (0, 10, 10)
    assert first.scene_version == second.scene_version == world.snapshot.scene_version - 1


def test_an_edit_that_fails_leaves_no_trace(world):
    """What was done before the error in the same edit is undone, in model and records."""
    before = world.snapshot

    def change(edit):
        edit.add_source("good", token=1)
        edit.add_source("arm", token=2)

    with pytest.raises(NameConflictError):
        world.edit(change)
    assert world.snapshot is before
    assert list(world.records) == ["arm"]
    world.edit(lambda edit: edit.add_source("good", token=1))
    assert set(world.records) == {"arm", "good"}


def test_ownership_is_proven_by_the_token(world):
    """The right token opens, a wrong one and a wrong name don't."""
    record = world.records["arm"]
    result, _ = world.edit(lambda edit: edit.owner("arm", world.handles["arm"].token))
    assert result == record
    with pytest.raises(OwnershipError):
        world.edit(lambda edit: edit.owner("arm", world.handles["arm"].token ^ 1))
    with pytest.raises(UnknownIdError):
        world.edit(lambda edit: edit.owner("leg", world.handles["arm"].token))


def test_frames_keep_their_poses_when_the_scene_changes(world):
    """An edit in between does not send frames home, and new frames start where they should."""
    move(world, 3.0, 5)

    def change(edit):
        record = edit.records["arm"]
        frame = edit.scene_graph.register_frame(record.id, GeometryFrame("tool"))
        edit.initial_poses[frame] = translation(7.0)

    world.edit(change)
    own = world.frames("arm")
    assert own.names == ("link", "tool")
    assert own.X_PF[:, 0, 3].tolist() == [3.0, 7.0]
    assert own.stamps.tolist() == [5, UNSTAMPED]


def test_readers_see_whole_updates_while_a_writer_writes(world):
    """Position and stamp of a snapshot belong together, whatever a thread does meanwhile."""
    stop = threading.Event()

    def write():
        i = 0
        while not stop.is_set():
            i += 1
            move(world, float(i), i)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        for _ in range(2000):
            snapshot = world.snapshot
            assert x_of(snapshot) == snapshot.stamp
    finally:
        stop.set()
        writer.join()


def test_only_stamps_after_a_time_are_forgotten():
    """What is forgotten may be replaced by anything; the poses hold."""
    graph = SceneGraph()
    source = graph.register_source("arm")
    for name in ("a", "b"):
        graph.register_frame(source, GeometryFrame(name))
    world = World(graph)
    own = world.frames("arm")
    own.X_PF[:] = translation(3.0)
    own.stamps[:] = [NOW, NOW + 5]
    assert world.commit({"arm"}, None).stamp == NOW + 5
    world.forget_stamps(after=NOW)
    assert own.stamps.tolist() == [NOW, UNSTAMPED]
    assert world.snapshot.stamp == NOW
    assert own.X_PF[:, 0, 3].tolist() == [3.0, 3.0]
