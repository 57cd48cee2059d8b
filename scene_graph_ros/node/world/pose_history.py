"""Where frames were in the last seconds: joints and poses, interpolated to a time. No rclpy.

Kept while a scene has a source that sends images, which are of a time that is past. Each message
of poses is a moment.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.node.world.intake import SourceFrames, UNSTAMPED
from scene_graph_ros.node.world.robot_motion import BASE, RobotMotion
from scene_graph_ros.node.world.tf_tree import pose_between
from scene_graph_ros.robots.robot_parts import JointType
from scene_graph_ros.robots.tree_of_model import tree_of_model

__all__ = ["KEPT", "NotYetError", "PastError", "PoseHistory"]

KEPT = 2_000_000_000
"""Nanoseconds that are remembered."""

_MOST = 512
"""Moments of a source."""

_MOST_BYTES = 1 << 24
"""Of a source's poses."""

Pose = NDArray[np.float64]


class NotYetError(SceneGraphError):
    """A time for which something was not heard yet."""


class PastError(SceneGraphError):
    """A time before all that is remembered."""


class _Between(NamedTuple):
    """Two moments, and how far a time is from the first to the second, 0 to 1."""

    first: int
    second: int
    ratio: float


def _between(stamps: list[NDArray[np.int64]], row: int, at: int, what: str) -> _Between:
    """Return the moments around a time, of one row; raises NotYetError or PastError."""
    newest = int(stamps[-1][row])
    if newest < at:
        lag = (at - newest) * 1e-9
        raise NotYetError(f"{what} was heard last {lag:.3f} s before it")
    k = len(stamps) - 1
    while k > 0 and int(stamps[k - 1][row]) >= at:
        k -= 1
    after = int(stamps[k][row])
    if after == at:
        return _Between(k, k, 0.0)
    before = UNSTAMPED if k == 0 else int(stamps[k - 1][row])
    if before == UNSTAMPED:
        raise PastError(f"{what} is remembered since {(after - at) * 1e-9:.3f} s after it only")
    return _Between(k - 1, k, (at - before) / (after - before))


class _Moments:
    """Moments of one source, oldest first: its stamps ``(n,)`` and a state each."""

    def __init__(self, owner: object) -> None:
        self.owner = owner
        self.stamps: deque[NDArray[np.int64]] = deque()
        self.states: deque[Any] = deque()
        self.is_static: NDArray[np.bool_] = np.zeros(0, np.bool_)

    def note(self, stamps: NDArray[np.int64], state: Any, is_static: Any, most: int) -> None:
        """Take the state now; forget what is too old, and more than so many."""
        if self.stamps and np.array_equal(self.stamps[-1], stamps):
            self.states[-1] = state
        else:
            self.stamps.append(stamps.copy())
            self.states.append(state)
        self.is_static = is_static.copy()
        newest = int(stamps.max(initial=UNSTAMPED))
        while len(self.stamps) > 2 and (
            len(self.stamps) > most
            or (newest > UNSTAMPED and int(self.stamps[1].max()) < newest - KEPT)
        ):
            self.stamps.popleft()
            self.states.popleft()

    def holds(self, row: int) -> bool:
        """Tell whether something stays where it is: it is static, or was never heard."""
        return bool(self.is_static[row]) or int(self.stamps[-1][row]) == UNSTAMPED


class _Robot(_Moments):
    """Moments of a robot: ``states`` are its configuration and the pose of its base."""

    def __init__(self, motion: RobotMotion) -> None:
        super().__init__(motion)
        self.motion = motion
        model = motion.robot.model
        self._tree = tree_of_model(model, follows=False)
        starts = [int(s) for s in self._tree.table.starts[1:]]
        ends = [*starts[1:], self._tree.num_positions]
        self._parts = {
            joint.name: slice(start, end)
            for joint, start, end in zip(self._tree.joints, starts, ends, strict=True)
        }
        self._turns = {n for n, j in model.joints.items() if j.type is JointType.CONTINUOUS}

    def link_poses(self, at: int) -> NDArray[np.float64]:
        """Return ``X_WL`` of the kinematics' links at a time."""
        stamps, motion = list(self.stamps), self.motion
        q, X_WB = self.states[-1]
        q = q.copy()
        for row, name in enumerate(motion.names):
            if self.holds(row):
                continue
            what = f"joint {quoted(name)}" if name else "the base"
            k = _between(stamps, row, at, f"{what} of {quoted(motion.robot.model.name)}")
            (q1, X1), (q2, X2) = self.states[k.first], self.states[k.second]
            if name == BASE:
                X_WB = pose_between(X1, X2, k.ratio)
                continue
            part = self._parts[name]
            if name in self._turns:
                step = np.remainder(q2[part] - q1[part] + np.pi, 2.0 * np.pi) - np.pi
                q[part] = q1[part] + k.ratio * step
            else:
                q[part] = self._tree.interpolate(q1, q2, k.ratio)[part]
        tree = self._tree.at(X_WB)
        return tree.link_poses(q, motion.kinematics.link_names)


class PoseHistory:
    """The last seconds of all sources; to be used with the world's lock held."""

    def __init__(self) -> None:
        self._moments: dict[str, _Moments] = {}

    def clear(self) -> None:
        """Forget all: the clock jumped."""
        self._moments.clear()

    def note(
        self, frames: Mapping[str, SourceFrames], motions: Mapping[str, RobotMotion | None]
    ) -> None:
        """Take the poses that there are now; ``motions`` are those of the robots."""
        for name in self._moments.keys() - frames.keys():
            del self._moments[name]
        self.note_some(frames, motions)

    def note_some(
        self, frames: Mapping[str, SourceFrames], motions: Mapping[str, RobotMotion | None]
    ) -> None:
        """Take the poses of some sources that there are now; the others keep their moments."""
        for name, each in frames.items():
            motion = motions[name]
            owner = each.ids if motion is None else motion
            known = self._moments.get(name)
            if known is None or known.owner != owner:
                known = _Moments(owner) if motion is None else _Robot(motion)
                self._moments[name] = known
            if motion is not None:
                kinematics = motion.kinematics
                state: Any = (kinematics.configuration, kinematics.X_PB)
                known.note(motion.stamps, state, motion.is_static, _MOST)
            elif len(each.ids):
                most = max(2, min(_MOST, _MOST_BYTES // max(each.X_PF.nbytes, 1)))
                known.note(each.stamps, each.X_PF.copy(), each.is_static, most)

    def place(
        self,
        wanted: Iterable[FrameId],
        at: int,
        inspector: Any,
        frames: Mapping[str, SourceFrames],
    ) -> dict[FrameId, Pose]:
        """Return ``X_WF`` of frames, and of those that they hang on, at a time, ns.

        What never was heard, is static, or is carried by a robot stays where it is in its parent.
        Raises NotYetError and PastError, which name what is not known at that time.
        """
        found = {inspector.world_frame_id(): np.eye(4)}
        links: dict[str, NDArray[np.float64]] = {}
        for frame in wanted:
            self._place(frame, at, inspector, frames, found, links)
        return found

    def _place(
        self,
        frame: FrameId,
        at: int,
        inspector: Any,
        frames: Mapping[str, SourceFrames],
        found: dict[FrameId, Pose],
        links: dict[str, NDArray[np.float64]],
    ) -> Pose:
        if frame in found:
            return found[frame]
        owner = inspector.get_name(inspector.get_owning_source_id(frame))
        moments, its = self._moments[owner], frames[owner]
        if isinstance(moments, _Robot):
            if owner not in links:
                links[owner] = moments.link_poses(at)
            carriers = list(moments.motion.robot.carriers.values())
            found[frame] = links[owner][carriers.index(frame)]
            return found[frame]
        parent = inspector.get_parent_frame(frame)
        X_WP = self._place(parent, at, inspector, frames, found, links)
        row = its.row_of_id[frame]
        if frame in its.attached or moments.holds(row):
            X_PF = moments.states[-1][row]
        else:
            k = _between(list(moments.stamps), row, at, f"frame {quoted(its.names[row])}")
            first, second = moments.states[k.first][row], moments.states[k.second][row]
            X_PF = first if k.first == k.second else pose_between(first, second, k.ratio)
        found[frame] = product(X_WP, X_PF)
        return found[frame]
