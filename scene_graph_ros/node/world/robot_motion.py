"""The motions of a robot, its joints and its base, and their newest stamps. No rclpy.

A stamp belongs to a joint. A link is as old as the oldest moving joint between it and the world;
static ones are left out, and a link that nothing moves is static itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.spatial.pose_kernels import check_poses, VALID
from scene_graph_ros.geometry.spatial.poses import compose, inverse
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, SourceFrames, UNSTAMPED
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.robots.robot_parts import JointType

if TYPE_CHECKING:
    from scene_graph_ros.scene_files.loaded_scene import LoadedRobot

__all__ = ["BASE", "MotionIntake", "RobotMotion"]

BASE = ""
"""Name of the motion of a robot's root link in the world, among those of its joints."""


class RobotMotion:
    """The joints of a robot, and its base where that moves: positions, stamps, links.

    ``names`` are those of the joints that are not fixed, and BASE. ``stamps`` ``(n,)`` are the
    newest ones, nanoseconds; ``is_static`` ``(n,)`` marks those that were sent once for good.
    """

    def __init__(self, robot: LoadedRobot, *, has_moving_base: bool = False) -> None:
        """Take a robot at its start: nothing was heard."""
        self.robot, self.kinematics = robot, robot.kinematics
        moving = [j.name for j in robot.model.joints.values() if j.type is not JointType.FIXED]
        self.names: tuple[str, ...] = (*moving, BASE) if has_moving_base else tuple(moving)
        self.rows = {name: row for row, name in enumerate(self.names)}
        self.stamps = np.full(len(self.names), UNSTAMPED, dtype=np.int64)
        self.is_static = np.zeros(len(self.names), dtype=np.bool_)
        self._depends = self._dependences()
        self.X_BL = robot.model.fixed_to_root()
        """Where links are on the root link, of those that fixed joints join to it."""
        self._frame_rows = np.zeros(0, dtype=np.int64)
        self._frames: SourceFrames | None = None

    def _dependences(self) -> NDArray[np.bool_]:
        """Return ``(links, n)``: which motions are between a link and the world."""
        model = self.robot.model
        above = {model.root: frozenset([BASE])}
        for joint in model.joints.values():
            above[joint.child] = above[joint.parent] | {joint.name}
        links = self.kinematics.link_names
        result = np.array([[n in above[link] for n in self.names] for link in links], np.bool_)
        return result.reshape(len(links), len(self.names))

    def followers(self, names: Sequence[str]) -> tuple[str, ...]:
        """Return the joints that mimic one of ``names``, or one that does, and are not named."""
        joints, found = self.robot.model.joints, dict.fromkeys(names)
        mimics = {n: m.joint for n in self.kinematics.joint_names if (m := joints[n].mimic)}
        while more := [n for n, leader in mimics.items() if leader in found and n not in found]:
            found.update(dict.fromkeys(more))
        return tuple(found)[len(dict.fromkeys(names)) :]

    def stamped(self, names: Sequence[str], stamp: int, *, is_static: bool) -> None:
        """Note that these were heard with a stamp."""
        rows = [self.rows[name] for name in names]
        self.stamps[rows], self.is_static[rows] = stamp, is_static

    def joint_stamps(self, static: int) -> dict[str, int]:
        """Return the stamps of joints by name, and of BASE, ``static`` if sent for good."""
        stamps = np.where(self.is_static, static, self.stamps).tolist()
        return dict(zip(self.names, stamps, strict=True))

    def silent(self) -> tuple[str, ...]:
        """Return the joints that were not heard, "base" for the base."""
        return tuple(
            name or "base"
            for name, stamp in zip(self.names, self.stamps.tolist(), strict=True)
            if stamp == UNSTAMPED
        )

    def take_over(self, other: RobotMotion) -> None:
        """Have the joints of the same names, and the base, where another robot has them."""
        known = other.kinematics.positions
        there = [name for name in self.kinematics.joint_names if name in known]
        if there:
            self.kinematics.update(there, [known[name] for name in there])
        if BASE in self.rows and BASE in other.rows:
            self.kinematics.X_PB = other.kinematics.X_PB
        for name, row in self.rows.items():
            if (name in there or name == BASE) and name in other.rows:
                self.stamps[row] = other.stamps[other.rows[name]]
                self.is_static[row] = other.is_static[other.rows[name]]

    def forget(self, after: int) -> None:
        """Forget stamps that say later than ``after``."""
        self.stamps[self.stamps > after] = UNSTAMPED

    @contextmanager
    def trial(self) -> Iterator[_Trial]:
        """Move joints or the base inside; they stay where they were unless it is ``accepted``."""
        state, trial = self.kinematics.state, _Trial()
        try:
            yield trial
        finally:
            if not trial.accepted:
                self.kinematics.state = state

    def write(self, X_WL: NDArray[np.float64], names: Sequence[str], frames: SourceFrames) -> int:
        """Put the links' frames in place; return how many depend on the named motions."""
        rows = self._rows_in(frames)
        there = rows >= 0
        frames.X_PF[rows[there]] = X_WL[there]
        self.write_stamps(frames)
        named = [self.rows[name] for name in names]
        return int(np.count_nonzero(self._depends[:, named].any(axis=1) & there))

    def write_stamps(self, frames: SourceFrames) -> None:
        """Give each link's frame the stamp of the oldest that it depends on."""
        rows = self._rows_in(frames)
        there = rows >= 0
        counts = self._depends & ~self.is_static
        newest = np.iinfo(np.int64).max
        stamps = np.where(counts, self.stamps, newest).min(axis=1, initial=newest)
        is_static = np.logical_not(np.any(counts, axis=1))
        frames.stamps[rows[there]] = np.where(is_static, UNSTAMPED, stamps)[there]
        frames.is_static[rows[there]] = is_static[there]

    def _rows_in(self, frames: SourceFrames) -> NDArray[np.int64]:
        """Return the row of each link's frame, below 0 where it is not registered."""
        if frames is not self._frames:
            ids = self.robot.carriers.values()
            found = [frames.row_of_id.get(frame_id, -1) for frame_id in ids]
            self._frame_rows, self._frames = np.array(found, dtype=np.int64), frames
        return self._frame_rows


class _Trial:
    accepted = False


class MotionIntake:
    """Judges messages about a robot's joints and base, and moves the robot by them."""

    def __init__(self, intake: Intake, motion: RobotMotion) -> None:
        self.intake, self.motion = intake, motion

    def time_of(self, stamp: int, limits: TimeLimits, *, is_static: bool) -> int | None:
        """Return a message's stamp, that of now for 0; None, and count it, out of the limits."""
        if stamp == 0:
            return limits.now
        used = limits.of_static() if is_static else limits
        problem = used.problem(stamp, UNSTAMPED)
        if problem is None:
            return stamp
        self.intake.fault(problem[0], "", f"a message {problem[1]}")
        return None

    def move_base(
        self,
        X_WL: NDArray[np.float64],
        link: str,
        stamp: int,
        frames: SourceFrames,
        *,
        is_static: bool,
    ) -> bool:
        """Put the robot where a link of it, which moves with the root link, is at ``X_WL``."""
        motion = self.motion
        X_WB = compose(X_WL, inverse(motion.X_BL[link]))
        with motion.trial() as trial:
            motion.kinematics.X_PB = X_WB
            trial.accepted = self.place([BASE], stamp, frames, is_static=is_static)
        return trial.accepted

    def in_order(self, names: Sequence[str], stamp: int, limits: TimeLimits) -> list[int]:
        """Return the indices of names that move at a stamp; count those that have a newer one."""
        motion, kept = self.motion, []
        for i, name in enumerate(names):
            newest = int(motion.stamps[motion.rows[name]])
            problem = None if stamp >= newest else limits.problem(stamp, newest)
            if problem is None:
                kept.append(i)
            else:
                noun = "joint" if name else "base"
                self.intake.fault(problem[0], name, f"a position {problem[1]}", noun=noun)
        return kept

    def place(
        self,
        names: Sequence[str],
        stamp: int,
        frames: SourceFrames,
        *,
        is_static: bool,
        joints: Sequence[str] = (),
        positions: ArrayLike = (),
    ) -> bool:
        """Work out the links with these joints moved; tell whether they are somewhere.

        To be called inside a trial of the motion. ``names`` get the stamp.
        """
        motion = self.motion
        _, X_WL = motion.kinematics.link_poses(joints, positions)
        row, status = check_poses(X_WL) if len(X_WL) else (-1, VALID)
        if status != VALID:
            where = X_WL[row, :3, 3].tolist()
            name = motion.kinematics.link_names[row]
            self.intake.fault(Fault.NOT_FINITE, name, f"the robot's joints place it at {where}")
            return False
        motion.stamped(names, stamp, is_static=is_static)
        self.intake.count(motion.write(X_WL, names, frames))
        return True
