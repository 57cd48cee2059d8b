"""Joint states of a robot: positions of its joints, in messages of one sender or of many."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from msg_adapters.poses import JointBatch, joints_from_msg
from msg_adapters.wire.poses import Layout
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, SourceFrames
from scene_graph_ros.node.world.queued_channel import QueuedChannel, Reading
from scene_graph_ros.node.world.robot_motion import MotionIntake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_topics import JOINT_STATE, pose_topic
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["JointChannel", "JointRates"]

_SENDERS_KEPT = 256
"""Sets of names whose rates are known; publishers use one or two each."""


class JointRates:
    """How often each joint is heard of: arrivals of messages by the names that they have."""

    def __init__(self) -> None:
        self._arrivals: dict[tuple[str, ...], deque[int]] = {}

    def heard(self, names: tuple[str, ...], arrival: int) -> None:
        """Count a message that arrived at a steady time, nanoseconds."""
        known = self._arrivals.get(names)
        if known is None:
            if len(self._arrivals) >= _SENDERS_KEPT:
                self._arrivals.clear()
            known = self._arrivals[names] = deque(maxlen=200)
        known.append(arrival)

    def rates(self, now: int, window: float = 2.0) -> dict[str, float]:
        """Return messages per second about each joint, over the last ``window`` seconds."""
        since, rates = now - int(window * 1e9), dict[str, float]()
        for names, arrivals in tuple(self._arrivals.items()):
            recent = [t for t in tuple(arrivals) if t >= since]
            span = window
            if len(recent) == arrivals.maxlen:
                span = max((recent[-1] - recent[0]) * 1e-9, 1e-9)
            for name in names:
                rates[name] = rates.get(name, 0.0) + len(recent) / span
        return rates


class JointChannel(QueuedChannel):
    """The joint states of one robot.

    A message moves the joints that it names, each of them unless it has a newer position: stamps
    of one sender say nothing about another's.
    """

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        super().__init__(record, intake, kind, JOINT_STATE)
        assert record.motion is not None
        self.motion = self._motion = record.motion
        self._judge = MotionIntake(intake, self._motion)
        self.rates = JointRates()

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {pose_topic(self.record): False}

    def _heard(self, names: tuple[str, ...], arrival: int) -> None:
        self.rates.heard(names, arrival)

    def _takes_all(self, layout: Layout, frames: SourceFrames) -> bool:
        return set(layout.names) <= set(self._motion.kinematics.joint_names)

    def _count_known(self, frames: SourceFrames) -> int:
        return len(self._motion.names)

    def _apply_layout(
        self, kept: Reading, layout: Layout, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        return self._apply_joints(layout.joints(kept.data), kept, frames, limits)

    def _apply_message(
        self, kept: Reading, message: Any, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        joints = joints_from_msg(message)
        self._heard(joints.names, kept.arrival)
        return self._apply_joints(joints, kept, frames, limits)

    def _apply_joints(
        self, joints: JointBatch, kept: Reading, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        for refused in joints.refused:
            self.intake.refused(refused, noun="joint")
        if not joints.names:
            return 0
        stamp = self._judge.time_of(joints.stamp_ns, limits, is_static=kept.is_static)
        if stamp is None:
            return 0
        known = [i for i, name in enumerate(joints.names) if self._is_known(name)]
        names = [joints.names[i] for i in known]
        kept_rows = self._judge.in_order(names, stamp, limits)
        if not kept_rows:
            return 0
        moved = [names[i] for i in kept_rows]
        values = joints.positions[[known[i] for i in kept_rows]].tolist()
        return self._move(moved, values, stamp, frames, is_static=kept.is_static)

    def _move(
        self,
        names: list[str],
        values: list[float],
        stamp: int,
        frames: SourceFrames,
        *,
        is_static: bool,
    ) -> int:
        """Move joints, and those that follow them unless they were measured later themselves."""
        motion, positions = self._motion, self._motion.kinematics.positions
        followers = motion.followers(names)
        measured = [n for n in followers if motion.stamps[motion.rows[n]] > stamp]
        following = [n for n in followers if n not in measured]
        with motion.trial() as trial:
            trial.accepted = self._judge.place(
                [*names, *following],
                stamp,
                frames,
                is_static=is_static,
                joints=[*names, *measured],
                positions=[*values, *(positions[n] for n in measured)],
            )
        return len(names) if trial.accepted else 0

    def _is_known(self, name: str) -> bool:
        motion = self._motion
        if name in motion.rows and name in motion.kinematics.joint_names:
            return True
        joint = motion.robot.model.joints.get(name)
        if joint is None:
            hint = suggestion(name, motion.kinematics.joint_names)
            text = f"the robot has no such joint{hint}"
        elif joint.type.value == "fixed":
            # Some publishers send all joints that there are; these have no position to set.
            return False
        else:
            text = f"the joint is {joint.type.value}: MultiDOFJointState messages move it"
        self.intake.fault(Fault.UNKNOWN_FRAME, name, text, noun="joint")
        return False
