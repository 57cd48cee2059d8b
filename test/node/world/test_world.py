"""The world without ROS: an edit is made beside the poses, and swapped in as a whole."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
import threading

import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryFrame, GeometryInstance, ProximityProperties, Sphere
from scene_graph_ros.node.world.handles import new_token
from scene_graph_ros.node.world.world import World

DEADLINE = 60.0
"""Seconds after which a test gives up: far more than anything takes on a busy machine."""


def add_frames(edit, source, *names):
    """Register frames with a ball each."""
    for name in names:
        frame = edit.scene_graph.register_frame(source, GeometryFrame(name))
        ball = GeometryInstance(np.eye(4), Sphere(0.1), f"ball_{name}")
        ball.set_properties(ProximityProperties())
        edit.scene_graph.register_geometry(source, frame, ball)


@pytest.fixture
def world():
    """Two frames of a source "a" with a ball each."""
    world = World()

    def change(edit):
        record = edit.add_source("a", token=new_token())
        add_frames(edit, record.id, "f", "g")
        return record

    world.edit(change)
    return world


def move(world, x, stamp):
    """Move all frames of "a" to x along the x axis."""
    with world.lock:
        frames = world.frames("a")
        frames.X_PF[:, 0, 3] = x
        frames.stamps[:] = stamp
        return world.commit(["a"], None)


def positions(snapshot):
    """Return where all frames but the world are along the x axis."""
    return snapshot.query.snapshot.X_WF[1:, 0, 3].tolist()


def test_who_watches_is_told_of_each_snapshot(world):
    """Of moves, edits and other changes, once each and with the new one there; then no more."""
    seen = []

    def told():
        seen.append(world.snapshot.sequence)

    world.watch(told)
    moved = move(world, 1.0, 1).sequence
    _, edited = world.edit(lambda edit: add_frames(edit, world.records["a"].id, "h"))
    world.forget_stamps()
    assert seen == [moved, edited.sequence, edited.sequence + 1]
    world.unwatch(told)
    move(world, 2.0, 2)
    assert len(seen) == 3


class Halted:
    """A step of an edit that waits until it is let go."""

    def __init__(self):
        self.is_reached, self.may_go_on = threading.Event(), threading.Event()

    def __call__(self, *_):
        """Wait."""
        self.is_reached.set()
        assert self.may_go_on.wait(DEADLINE)


@pytest.mark.parametrize("step", ["change", "prepare"])
def test_poses_go_on_while_an_edit_takes_long(world, step):
    """Neither the change nor its preparation holds the lock; what came meanwhile is kept."""
    halted = Halted()
    source = world.records["a"].id

    def change(edit):
        add_frames(edit, source, "h")
        if step == "change":
            halted()

    prepare = halted if step == "prepare" else lambda snapshot: None
    with ThreadPoolExecutor(1) as pool:
        edited = pool.submit(world.edit, change, prepare)
        assert halted.is_reached.wait(DEADLINE)
        assert world.lock.acquire(blocking=False), "an edit holds the lock while it waits"
        world.lock.release()
        assert positions(move(world, 1.0, 10)) == [1.0, 1.0]
        assert world.snapshot.scene_version == 1
        halted.may_go_on.set()
        _, snapshot = edited.result(DEADLINE)
    assert snapshot.scene_version == 2
    assert positions(snapshot) == [1.0, 1.0, 0.0]
    assert snapshot.source_stamp("a") == 10
    assert positions(move(world, 2.0, 20)) == [2.0, 2.0, 2.0]


def test_an_edit_is_prepared_as_it_will_be_and_before_it_counts(world):
    """The preparation sees the changed scene in the poses of now, and others still the old one."""
    move(world, 1.0, 10)
    seen = []
    source = world.records["a"].id
    world.edit(
        lambda edit: add_frames(edit, source, "h"),
        lambda snapshot: seen.append(
            (snapshot.scene_version, positions(snapshot), world.snapshot.scene_version)
        ),
    )
    assert seen == [(2, [1.0, 1.0, 0.0], 1)]


def test_an_edit_that_raises_leaves_no_trace(world):
    """Neither the model nor the poses change, and the next edit is not held up."""
    before = world.snapshot

    def change(edit):
        add_frames(edit, world.records["a"].id, "h")
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        world.edit(change)
    assert world.snapshot is before
    _, after = world.edit(lambda edit: edit.add_source("b", token=1))
    assert after.scene_version == before.scene_version + 1


def test_whose_a_name_is_changes_when_an_edit_counts(world):
    """One that is refused after all leaves faults in poses with the reason that they had."""
    foreign = dict(world.frames("a").foreign)

    def change(edit):
        add_frames(edit, edit.add_source("b", token=1).id, "h")

    def refuse(snapshot):
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        world.edit(change, refuse)
    assert world.frames("a").foreign == foreign == {"f": "a", "g": "a"}
    world.edit(change)
    assert world.frames("a").foreign == {"f": "a", "g": "a", "h": "b"}


def test_accuracy_that_is_set_during_an_edit_holds(world):
    """The copy that the edit was made on does not bring the old tier back."""

    def change(edit):
        world.set_accuracy("quick")
        edit.add_source("b", token=1)

    _, snapshot = world.edit(change)
    assert snapshot.query.accuracy.value == "quick"
    assert world.snapshot.query.accuracy.value == "quick"


def test_names_of_what_stays_are_the_same_objects(world):
    """An edit that adds a source makes no name anew, one that moves a ball to another does."""
    names = world.snapshot.names
    ids = [int(i) for i in world.snapshot.inspector.get_all_geometry_ids()]
    known = [names.geometry_name(i) for i in ids]
    _, after = world.edit(lambda edit: edit.add_source("b", token=1))
    assert [after.names.known_name(i) for i in ids] == known
    assert all(after.names.known_name(i) is name for i, name in zip(ids, known, strict=True))
    record, graph = world.records["a"], world.snapshot.inspector
    frame = graph.get_frame_id_by_name(record.id, "f")
    _, renamed = world.edit(lambda edit: edit.scene_graph.rename_frame(record.id, frame, "new"))
    assert [renamed.names.known_name(i) is name for i, name in zip(ids, known, strict=True)] == [
        False,
        True,
    ]
    assert renamed.names.geometry_name(ids[0]).frame == "new"
