"""Validation of a source's messages: poses that may be applied, and counts of the rest.

Nothing here knows topics or rclpy. A pose that can't be applied is counted by its reason, named
in one warning per source, reason and frame, and changes nothing; the other poses of the same
message are applied.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from msg_adapters.poses import PoseBatch, PoseFault, RefusedPose
from msg_adapters.wire.poses import Layout
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.record_kernels import IN_TIME, judge_times
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["UNSTAMPED", "Intake", "SourceFrames", "Statistics"]

UNSTAMPED = np.iinfo(np.int64).min
"""Stamp of a frame whose pose never came from a message, nanoseconds."""

_WARNINGS_KEPT = 100
"""Distinct warnings per source; what is wrong beyond that is only counted."""

_PLANS_KEPT = 4096
"""Sets of names whose frames are remembered; each object may have a message of its own."""


_FAULTS = {
    PoseFault.NOT_FINITE: Fault.NOT_FINITE,
    PoseFault.FAR_AWAY: Fault.NOT_FINITE,
    PoseFault.NOT_UNIT_QUATERNION: Fault.NOT_UNIT,
    PoseFault.CONTRADICTORY: Fault.CONTRADICTORY,
}


@dataclass
class SourceFrames:
    """The frames of one source in registration order, with their newest poses.

    ``X_PF`` is ``(n, 4, 4)``; ``stamps`` ``(n,)`` nanoseconds; ``is_static`` ``(n,)`` marks frames
    that never get old, none at first. Frames with ids in ``attached`` are carried by a link: their
    poses count only where they say that they are in it. ``foreign`` maps names of other sources'
    frames to the source that owns them.
    """

    source: str
    ids: tuple[Any, ...]
    names: tuple[str, ...]
    parents: tuple[str, ...]
    X_PF: np.ndarray
    stamps: np.ndarray
    is_static: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    foreign: dict[str, str] = field(default_factory=dict)
    attached: frozenset[Any] = frozenset()
    rows: dict[str, int] = field(init=False)
    row_of_id: dict[Any, int] = field(init=False)

    def __post_init__(self) -> None:
        if len(self.is_static) != len(self.names):
            self.is_static = np.zeros(len(self.names), dtype=np.bool_)
        self.rows = {name: row for row, name in enumerate(self.names)}
        self.row_of_id = {frame_id: row for row, frame_id in enumerate(self.ids)}


class Statistics:
    """Counts and times of one source's messages; nanoseconds of a steady clock."""

    def __init__(self) -> None:
        self.received = 0
        self.superseded = 0
        self.applied_messages = 0
        self.applied_poses = 0
        self.faults: Counter[Fault] = Counter()
        self.first_arrival: int | None = None
        self.last_arrival: int | None = None
        self.is_static = False
        """Whether the newest message was static: of who does not send again."""
        self._arrivals: deque[int] = deque(maxlen=200)

    def arrived(self, now: int, *, is_static: bool = False) -> None:
        """Count a message that came at steady time ``now``."""
        self.received += 1
        self.is_static = is_static
        self.last_arrival = now
        if self.first_arrival is None:
            self.first_arrival = now
        self._arrivals.append(now)

    def rate(self, now: int, window: float = 2.0) -> float:
        """Return messages per second over the last ``window`` seconds, at most 200 messages."""
        since = now - int(window * 1e9)
        recent = [t for t in tuple(self._arrivals) if t >= since]
        if len(recent) < 2:
            return len(recent) / window
        if len(recent) == self._arrivals.maxlen:
            return (len(recent) - 1) / max((recent[-1] - recent[0]) * 1e-9, 1e-9)
        return len(recent) / window

    @property
    def dropped(self) -> int:
        """Count all poses and messages that were not applied for a fault."""
        return sum(self.faults.values())


@dataclass(frozen=True)
class _Plan:
    """The rows of poses, the same for all messages with the same names."""

    names: tuple[str, ...]
    parents: tuple[str, ...]
    frames: SourceFrames
    rows: np.ndarray
    usable: np.ndarray
    strangers: tuple[int, ...]
    misplaced: tuple[int, ...]
    """Indices of poses that are given in another frame than the parent."""
    takes_all: bool
    """Whether no name is reason to refuse a pose."""
    covers_all: bool
    """Whether the poses are those of all frames in their order."""


class Intake:
    """Validates the messages of one source and keeps count."""

    def __init__(
        self,
        source: str,
        warn: Callable[[str], None],
        *,
        unknown_is_normal: bool = False,
        noun: str = "frame",
    ) -> None:
        """Warn about things that are called ``noun`` where they have a name."""
        self.source = source
        self._noun = noun
        self.statistics = Statistics()
        self._warn = warn
        self._warned: set[tuple[Fault, str]] = set()
        self._unknown_is_normal = unknown_is_normal
        self._plans: dict[int, _Plan] = {}

    def fault(
        self, fault: Fault, frame: str, detail: str, count: int = 1, *, noun: str = ""
    ) -> None:
        """Count ``count`` poses of ``frame`` as faulty, and warn where that is new.

        ``noun`` is the kind of thing that ``frame`` names, if not the usual one.
        """
        self.statistics.faults[fault] += count
        if len(self._warned) >= _WARNINGS_KEPT:
            return
        name = quoted(frame) if frame else ""
        if (fault, name) in self._warned:
            return
        self._warned.add((fault, name))
        where = f"source {quoted(self.source)}" + (
            f", {noun or self._noun} {name}" if frame else ""
        )
        self._warn(f"{where}: {detail} ({fault.value}; counted, warned about once)")
        if len(self._warned) == _WARNINGS_KEPT:
            self._warn(f"source {quoted(self.source)}: further faults are only counted")

    def refused(self, pose: RefusedPose, *, noun: str = "") -> None:
        """Count a pose or a position that is no good by itself."""
        self.fault(_FAULTS[pose.fault], pose.name, pose.message, noun=noun)

    def accept(
        self,
        batch: PoseBatch,
        frames: SourceFrames,
        limits: TimeLimits,
        *,
        is_static: bool = False,
    ) -> int:
        """Write the valid poses of ``batch`` into ``frames`` and return how many there were.

        Those that are ``is_static`` are never too old.
        """
        limits = limits.of_static() if is_static else limits
        for refused in batch.refused:
            self.refused(refused)
        plan = self._plan(batch.names, batch.parents, frames)
        stamps = batch.stamps_ns.copy()
        for index in plan.strangers:
            self._name_stranger(batch.names[index], frames)
        for index in plan.misplaced:
            claimed, row = batch.parents[index], plan.rows[index]
            relation = "is attached to" if frames.ids[row] in frames.attached else "has the parent"
            detail = (
                f"the pose is given in {quoted(claimed)}, the frame {relation}"
                f" {quoted(frames.parents[row])}"
            )
            self.fault(Fault.WRONG_PARENT, batch.names[index], detail)
        valid = plan.usable & self._in_time(plan, stamps, limits)
        if valid.all():
            rows = slice(None) if plan.covers_all else plan.rows
            self._store(frames, rows, batch.X_PF, stamps, is_static)
        else:
            chosen = np.flatnonzero(valid)
            self._store(frames, plan.rows[chosen], batch.X_PF[chosen], stamps[chosen], is_static)
        return int(np.count_nonzero(valid))

    def accept_bytes(
        self,
        data: bytes,
        layout: Layout,
        names: tuple[str, ...],
        frames: SourceFrames,
        limits: TimeLimits,
        *,
        is_static: bool = False,
    ) -> int | None:
        """Write the poses of a message, of frames called ``names``, where all are valid.

        Returns how many, or None: then nothing was written or counted, and `accept` is to judge
        each pose for itself.
        """
        plan = self._plan(names, layout.parents, frames)
        limits = limits.of_static() if is_static else limits
        if not plan.takes_all or not layout.place_poses(
            data, plan.rows, limits.bounds(), frames.X_PF, frames.stamps
        ):
            return None
        frames.is_static[plan.rows] = is_static
        self.count(len(names))
        return len(names)

    def _store(
        self,
        frames: SourceFrames,
        rows: np.ndarray | slice,
        X_PF: np.ndarray,
        stamps: np.ndarray,
        is_static: bool,
    ) -> None:
        if stamps.size == 0:
            return
        frames.X_PF[rows] = X_PF
        frames.stamps[rows] = stamps
        frames.is_static[rows] = is_static
        self.count(int(stamps.size))

    def count(self, poses: int) -> None:
        """Count a message of which so many poses were applied."""
        self.statistics.applied_poses += poses
        self.statistics.applied_messages += 1

    def takes_all(
        self, names: tuple[str, ...], parents: tuple[str, ...], frames: SourceFrames
    ) -> bool:
        """Tell whether no name of a message is a fault by itself."""
        plan = self._plan(names, parents, frames)
        return not plan.misplaced and (self._unknown_is_normal or not plan.strangers)

    def _plan(
        self, names: tuple[str, ...], parents: tuple[str, ...], frames: SourceFrames
    ) -> _Plan:
        """Look names up, once for as long as the same tuple of names comes."""
        plan = self._plans.get(id(names))
        if (
            plan is not None
            and plan.names is names
            and plan.frames is frames
            and (plan.parents is parents or plan.parents == parents)
        ):
            return plan
        if len(self._plans) >= _PLANS_KEPT:
            self._plans.clear()
        find = frames.rows.get
        rows = np.array([find(name, -1) for name in names], dtype=np.int64)
        strangers = tuple(np.flatnonzero(rows < 0).tolist())
        misplaced = tuple(
            index
            for index, (row, claimed) in enumerate(zip(rows.tolist(), parents, strict=True))
            if row >= 0 and claimed not in _parents_of(frames, row)
        )
        usable = rows >= 0
        usable[list(misplaced)] = False
        takes_all = bool(usable.all())
        covers_all = np.array_equal(rows, np.arange(len(frames.names)))
        plan = _Plan(
            names, parents, frames, rows, usable, strangers, misplaced, takes_all, covers_all
        )
        self._plans[id(names)] = plan
        return plan

    def _name_stranger(self, name: str, frames: SourceFrames) -> None:
        owner = frames.foreign.get(name)
        if self._unknown_is_normal:
            self.statistics.faults[Fault.UNKNOWN_FRAME] += 1
        elif owner is not None:
            self.fault(Fault.WRONG_SOURCE, name, f"the frame belongs to source {quoted(owner)}")
        else:
            self.fault(Fault.UNKNOWN_FRAME, name, "no such frame is registered")

    def _in_time(self, plan: _Plan, stamps: np.ndarray, limits: TimeLimits) -> np.ndarray:
        """Mark the poses that may be applied, and give those without a stamp that of now."""
        newest, rows = plan.frames.stamps, np.where(plan.usable, plan.rows, -1)
        statuses = np.empty(len(stamps), dtype=np.int64)
        if judge_times(stamps, rows, newest, limits.bounds(), statuses):
            for index in np.flatnonzero(statuses).tolist():
                status, stamp = int(statuses[index]), int(stamps[index])
                problem, detail = limits.describe(status, stamp, int(newest[rows[index]]))
                self.fault(problem, plan.names[index], f"a pose {detail}")
        return statuses == IN_TIME


def _parents_of(frames: SourceFrames, row: int) -> tuple[str, ...]:
    """Return the names of the frame in which poses of a frame may be given."""
    parent = frames.parents[row]
    return (parent,) if frames.ids[row] in frames.attached else ("", parent)
