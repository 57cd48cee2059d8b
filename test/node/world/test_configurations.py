"""What of the configurations that arrive is applied, and how the rest is counted."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.serialization import serialize_message

from msg_adapters.deformables import configurations_to_msg
from scene_graph_ros.geometry import Box, GeometryInstance, SceneGraph
from scene_graph_ros.node.world.configurations import ConfigurationChannel
from scene_graph_ros.node.world.deformables import deformables_by_source
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

NOW = 1_000_000_000_000
LIMITS = TimeLimits(now=NOW, max_age=5_000_000_000, max_lead=1_000_000_000)


@pytest.fixture
def soft():
    """Two sources with a cube each, and a channel of the first."""
    graph = SceneGraph()
    sources, ids = {}, {}
    for name in ("a", "b"):
        sources[name] = graph.register_source(name)
        world = graph.model_inspector().world_frame_id()
        instance = GeometryInstance(np.eye(4), Box(1, 1, 1), f"cube_{name}")
        ids[name] = graph.register_deformable_geometry(sources[name], world, instance)
    inspector = graph.model_inspector()
    warnings = []
    intake = Intake("a", warnings.append, noun="geometry")
    deformables = deformables_by_source(inspector, sources)
    q = inspector.get_reference_mesh(ids["a"]).vertices
    return SimpleNamespace(
        graph=graph,
        sources=sources,
        ids=ids,
        deformables=deformables,
        q=q,
        intake=intake,
        warnings=warnings,
        channel=ConfigurationChannel(SourceRecord(sources["a"], "a"), intake, "world"),
    )


def send(soft, positions, *, name="cube_a", stamp=0, frame_id="", arrival=1):
    """Let a message arrive."""
    message = configurations_to_msg({name: positions}, stamp_ns=stamp, frame_id=frame_id)
    soft.channel.store(serialize_message(message), arrival)


def update(soft):
    """Apply what has arrived; return when the oldest message that counted arrived."""
    return soft.channel.apply(soft.channel.take(), soft.deformables["a"], LIMITS)


def test_the_newest_of_several_holds(soft):
    """All that arrived is applied in its order, and the oldest arrival is what latency counts."""
    for i in range(3):
        send(soft, soft.q + i, stamp=NOW + i, arrival=10 + i)
    assert update(soft) == 10
    own = soft.deformables["a"]
    np.testing.assert_array_equal(own.positions[soft.ids["a"]], soft.q + 2)
    assert own.stamp() == NOW + 2
    assert own.fresh == {soft.ids["a"]}
    assert soft.intake.statistics.applied_messages == 3
    assert update(soft) is None


def test_without_a_stamp_it_is_now(soft):
    """A zero stamp is the time of the node's clock."""
    send(soft, soft.q)
    update(soft)
    assert soft.deformables["a"].stamp() == NOW


@pytest.mark.parametrize(
    ("fault", "fields"),
    [
        (Fault.STALE, {"stamp": NOW - 6_000_000_000}),
        (Fault.FUTURE, {"stamp": NOW + 2_000_000_000}),
        (Fault.OUT_OF_ORDER, {"stamp": NOW - 1}),
        (Fault.WRONG_PARENT, {"frame_id": "map"}),
        (Fault.WRONG_SOURCE, {"name": "cube_b"}),
        (Fault.UNKNOWN_GEOMETRY, {"name": "ghost"}),
    ],
)
def test_what_is_wrong_changes_nothing(soft, fault, fields):
    """It is counted each time, named in one warning, and the last good one holds."""
    send(soft, soft.q + 1, stamp=NOW, arrival=1)
    for arrival in (2, 3):
        send(soft, soft.q + 5, arrival=arrival, **{"stamp": NOW, **fields})
    assert update(soft) == 1
    np.testing.assert_array_equal(soft.deformables["a"].positions[soft.ids["a"]], soft.q + 1)
    assert soft.intake.statistics.faults == {fault: 2}
    (warning,) = soft.warnings
    assert "source 'a'" in warning
    assert "frame '" not in warning


@pytest.mark.parametrize(
    ("fault", "positions"),
    [
        (Fault.WRONG_LENGTH, np.zeros((7, 3))),
        (Fault.NOT_FINITE, np.full((8, 3), np.nan)),
        (Fault.NOT_FINITE, np.full((8, 3), np.inf)),
    ],
)
def test_positions_that_are_none(soft, fault, positions):
    """As many as the mesh has, all of them finite; a warning quotes the vertex."""
    send(soft, np.resize(positions, (len(soft.q), 3)) if len(positions) == 8 else positions)
    assert update(soft) is None
    assert soft.intake.statistics.faults == {fault: 1}
    assert not soft.deformables["a"].positions


def test_bytes_that_are_no_message_are_counted(soft):
    """The node survives them, and what follows is applied."""
    soft.channel.store(b"\x00\x01\x00\x00 nothing", 1)
    send(soft, soft.q, arrival=2)
    assert update(soft) == 2
    assert soft.intake.statistics.faults == {Fault.MALFORMED: 1}


def test_a_flood_stays_bounded(soft):
    """Of many messages between two updates the newest few are kept, the others counted."""
    for i in range(100):
        send(soft, soft.q + i, stamp=NOW + i, arrival=i)
    assert update(soft) >= 80
    np.testing.assert_array_equal(soft.deformables["a"].positions[soft.ids["a"]], soft.q + 99)
    assert soft.intake.statistics.received == 100
    assert soft.intake.statistics.superseded == 84


def test_the_world_keeps_configurations_when_the_scene_changes(soft):
    """Another geometry of another source changes no vertex; without its geometry one is gone."""
    world = World(soft.graph)
    ids = soft.ids
    world.deformables["a"].put(ids["a"], soft.q + 3, NOW)
    snapshot = world.commit((), None, {"a"})
    assert snapshot.stamp == snapshot.source_stamp("a") == NOW
    assert snapshot.source_stamp("b") == UNSTAMPED
    np.testing.assert_array_equal(snapshot.query.get_configurations_in_world(ids["a"]), soft.q + 3)

    def remove(edit):
        edit.scene_graph.remove_geometry(soft.sources["b"], ids["b"])

    _, later = world.edit(remove)
    assert set(world.deformables) == {"a"}
    np.testing.assert_array_equal(later.query.get_configurations_in_world(ids["a"]), soft.q + 3)
    # The snapshot from before is as it was.
    assert len(snapshot.inspector.get_all_deformable_geometry_ids()) == 2
    world.forget_stamps(after=NOW)
    assert world.snapshot.source_stamp("a") == NOW
    world.forget_stamps(after=NOW - 1)
    assert world.snapshot.source_stamp("a") == UNSTAMPED


def test_only_what_is_fresh_becomes_another_configuration(soft):
    """Geometry that did not move keeps its configuration, and all that was derived from it."""
    world = World(soft.graph)
    before = world.snapshot.query.snapshot.configuration(soft.ids["b"])
    world.deformables["a"].put(soft.ids["a"], soft.q + 3, NOW)
    after = world.commit((), None, {"a"}).query.snapshot
    assert after.configuration(soft.ids["b"]) is before
    first = after.configuration(soft.ids["a"])
    assert world.commit((), None, {"a"}).query.snapshot.configuration(soft.ids["a"]) is first
