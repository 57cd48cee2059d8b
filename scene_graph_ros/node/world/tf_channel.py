"""Transforms of TF: a source's frames, or a robot's base, composed through frames of anybody."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from msg_adapters.poses import PoseBatch, poses_from_tf
from msg_adapters.wire.poses import Layout
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, SourceFrames, UNSTAMPED
from scene_graph_ros.node.world.queued_channel import QueuedChannel, Reading
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import pose_topic, TF
from scene_graph_ros.node.world.tf_tree import (
    HISTORY,
    MissingTransformError,
    Placed,
    STATIC,
    TfTree,
)
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["STATIC_TOPIC", "TfChannel", "TfReader"]

STATIC_TOPIC = "/tf_static"
"""Topic of transforms that never change."""

_PATIENCE = 1_000_000_000
"""Nanoseconds that a chain may be incomplete before somebody is told: at a start it is."""


class TfReader(QueuedChannel):
    """A tree of transforms, by which frames are placed at each update."""

    queued = 1024

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any, topic: str) -> None:
        super().__init__(record, intake, kind, TF)
        self._topic = topic
        self.tree = TfTree(interpolates=record.interpolates)
        self.missing: dict[str, str] = {}
        """Why frames can't be placed, by name."""
        self._missing_since: dict[str, int] = {}
        self._fresh = 0
        self._found: dict[str, Placed] = {}
        self._owner: SourceFrames | None = None

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Names of the topics, before namespaces and remapping."""
        return {self._topic: False, STATIC_TOPIC: True}

    def forget(self, after: int) -> None:
        """Forget transforms that are stamped later."""
        self.tree.forget(after)
        self._found.clear()

    def apply(self, kept: list[Kept], target: SourceFrames, limits: TimeLimits) -> int | None:
        """Take transforms into the tree, and place frames by it."""
        self._fresh = 0
        arrival = super().apply(kept, target, limits)
        if target is not self._owner:
            # Frames may be other ones, or hang on others, than before.
            self._owner = target
            self._found.clear()
        elif not self._fresh:
            return None
        moved = self._place(target, limits)
        return (arrival if arrival is not None else kept[0].arrival) if moved else None

    def _takes_all(self, layout: Layout, frames: SourceFrames) -> bool:
        # Older transforms count, too: between them others are interpolated.
        return False

    def _count_known(self, frames: SourceFrames) -> int:
        return 10 * len(frames.names)

    def _apply_layout(
        self, kept: Reading, layout: Layout, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        return self._take(layout.poses(kept.data), limits, is_static=kept.is_static)

    def _apply_message(
        self, kept: Reading, message: Any, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        return self._take(poses_from_tf(message), limits, is_static=kept.is_static)

    def _take(self, batch: PoseBatch, limits: TimeLimits, *, is_static: bool) -> int:
        """Take a message into the tree; return the number of new transforms."""
        for refused in batch.refused:
            self.intake.refused(refused)
        used, count = limits.of_static() if is_static else limits, 0
        each = zip(batch.names, batch.parents, batch.stamps_ns.tolist(), batch.X_PF, strict=True)
        for name, parent, stamp, X in each:
            time = stamp or limits.now
            problem = used.problem(time, UNSTAMPED) or self._too_late(name, time)
            if problem is not None:
                self.intake.fault(problem[0], name, f"a transform {problem[1]}")
            elif name == parent:
                self.intake.fault(Fault.WRONG_PARENT, name, "a frame can't be its own parent")
            else:
                count += self.tree.put(name, parent, X, time, is_static=is_static)
        self._fresh += count
        return count

    def _too_late(self, name: str, stamp: int) -> tuple[Fault, str] | None:
        """Say why a transform comes too late to count, None where it does not."""
        newest = self.tree.newest(name)
        if newest is None or stamp >= newest - HISTORY:
            return None
        lag = (newest - stamp) * 1e-9
        return Fault.OUT_OF_ORDER, (
            f"is stamped {lag:.3f} s before the newest of its frame; {HISTORY * 1e-9:g} s are kept"
        )

    @abstractmethod
    def _wanted(self, frames: SourceFrames) -> Iterable[tuple[str, str]]:
        """Return the frames to place, and the frames to place them in: names as TF has them."""

    @abstractmethod
    def _moved(
        self, placed: Mapping[str, Placed], frames: SourceFrames, limits: TimeLimits
    ) -> bool:
        """Take where the wanted frames are, those that are elsewhere, or of another time."""

    def _place(self, frames: SourceFrames, limits: TimeLimits) -> bool:
        changed: dict[str, Placed] = {}
        for name, base in self._wanted(frames):
            try:
                placed = self.tree.place(name, base)
            except MissingTransformError as error:
                self._miss(name, str(error), limits)
                continue
            self.missing.pop(name, None)
            self._missing_since.pop(name, None)
            known = self._found.get(name)
            if (
                known is None
                or known.stamp != placed.stamp
                or not np.array_equal(known.X, placed.X)
            ):
                changed[name] = self._found[name] = placed
        return bool(changed) and self._moved(changed, frames, limits)

    def _miss(self, name: str, why: str, limits: TimeLimits) -> None:
        """Keep why a frame can't be placed; count it as a fault where that lasts."""
        self.missing[name] = why
        since = self._missing_since.setdefault(name, limits.now)
        if limits.now - since > _PATIENCE and self.tree.newest(name) is not None:
            self.intake.fault(Fault.WRONG_PARENT, name, why)


class TfChannel(TfReader):
    """A source's frames: each is placed in the parent that it was registered with."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        super().__init__(record, intake, kind, pose_topic(record))

    def _wanted(self, frames: SourceFrames) -> Iterable[tuple[str, str]]:
        return zip(frames.names, frames.parents, strict=True)

    def _moved(
        self, placed: Mapping[str, Placed], frames: SourceFrames, limits: TimeLimits
    ) -> bool:
        for name, (X, stamp) in placed.items():
            row = frames.rows[name]
            frames.X_PF[row] = X
            frames.is_static[row] = stamp == STATIC
            frames.stamps[row] = limits.now if stamp == STATIC else stamp
        self.intake.count(len(placed))
        return True
