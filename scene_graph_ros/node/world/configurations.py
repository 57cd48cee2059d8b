"""Configurations of deformable geometry: messages of them, validated and applied.

Imported where a source has deformable geometry.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from msg_adapters.deformables import ConfigurationBatch, configurations_from_msg
from scene_graph_msgs.msg import DeformableConfigurations
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.node.world.bounded_channel import BoundedChannel
from scene_graph_ros.node.world.deformables import SourceDeformables
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import configuration_topic
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["ConfigurationChannel", "accept_configurations"]

_BYTES_PER_VERTEX = 24
"""Of a configuration in a message."""


def accept_configurations(
    batch: ConfigurationBatch,
    deformables: SourceDeformables,
    limits: TimeLimits,
    *,
    intake: Intake,
    world_frame: str,
    is_static: bool = False,
) -> int:
    """Take the valid configurations of ``batch`` into ``deformables``; return how many.

    Faulty ones are counted and warned about by ``intake``, and change nothing. If ``is_static``,
    none is too old.
    """
    limits = limits.of_static() if is_static else limits
    if batch.frame_id not in ("", world_frame):
        detail = f"positions are given in {quoted(batch.frame_id)}, not in {quoted(world_frame)}"
        intake.fault(Fault.WRONG_PARENT, "", detail, max(len(batch.names), 1))
        return 0
    stamp = batch.stamp_ns or limits.now
    accepted = 0
    for name, positions in zip(batch.names, batch.positions, strict=True):
        problem = _problem(name, positions, stamp, deformables, limits)
        if problem is not None:
            intake.fault(problem[0], name, problem[1])
            continue
        deformables.put(deformables.ids[name], positions, stamp)
        accepted += 1
    intake.statistics.applied_poses += accepted
    intake.statistics.applied_messages += accepted > 0
    return accepted


def _problem(
    name: str,
    positions: np.ndarray,
    stamp: int,
    deformables: SourceDeformables,
    limits: TimeLimits,
) -> tuple[Fault, str] | None:
    """Return the fault of one configuration, or None."""
    geometry_id = deformables.ids.get(name)
    if geometry_id is None:
        return _stranger(name, deformables)
    count = deformables.counts[geometry_id]
    if len(positions) != count:
        return Fault.WRONG_LENGTH, f"{len(positions)} vertices are given, the mesh has {count}"
    if not np.all(np.abs(positions) <= MAX_COORDINATE):
        row = int(np.argmin((np.abs(positions) <= MAX_COORDINATE).all(axis=1)))
        return (
            Fault.NOT_FINITE,
            f"vertex {row} is not finite, or farther than {MAX_COORDINATE:g} m away: "
            f"{positions[row].tolist()}",
        )
    late = limits.problem(stamp, deformables.stamps.get(geometry_id, stamp))
    return late and (late[0], f"a configuration {late[1]}")


def _stranger(name: str, deformables: SourceDeformables) -> tuple[Fault, str]:
    owner = deformables.foreign.get(name)
    if name in deformables.ambiguous:
        return Fault.UNKNOWN_GEOMETRY, "several deformable geometries of the source are called so"
    if owner is not None:
        return Fault.WRONG_SOURCE, f"the geometry belongs to source {quoted(owner)}"
    return Fault.UNKNOWN_GEOMETRY, "no such deformable geometry is registered"


class ConfigurationChannel(BoundedChannel[SourceDeformables]):
    """The configuration topic of one source."""

    noun = "configurations"

    def __init__(self, record: SourceRecord, intake: Intake, world_frame: str) -> None:
        super().__init__(record, intake, DeformableConfigurations)
        self._world_frame = world_frame

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {configuration_topic(self.record): False}

    def _apply_one(self, kept: Kept, deformables: SourceDeformables, limits: TimeLimits) -> int:
        vertices = sum(deformables.counts.values())
        most = most_bytes(len(deformables.counts)) + _BYTES_PER_VERTEX * vertices
        return accept_configurations(
            configurations_from_msg(self._read(kept.data, most)),
            deformables,
            limits,
            intake=self.intake,
            world_frame=self._world_frame,
            is_static=kept.is_static,
        )
