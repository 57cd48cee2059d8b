"""Transforms as TF sends them: a tree of frames, most of which nobody registered. No rclpy.

A frame hangs on one parent, by a static transform or by one that is told again and again. Of the
latter the last seconds are kept, so that a chain can be composed as it was at one time.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.elementary import arc_sine, sine_cosine
from scene_graph_ros.geometry.spatial.poses import (
    compose,
    inverse,
    poses_from_quaternions,
    quaternions_from_poses,
)
from scene_graph_ros.geometry.spatial.sums import length, product

__all__ = ["HISTORY", "STATIC", "MissingTransformError", "Placed", "TfTree", "pose_between"]

STATIC = np.iinfo(np.int64).max
"""Stamp of what never gets old."""

HISTORY = 10_000_000_000
"""Nanoseconds for which transforms are kept, as in tf2."""

_MOST_KEPT = 2000
"""Transforms kept of one frame: ten seconds at 200 Hz."""

_MOST_FRAMES = 20_000
"""Frames that are known at most; a robot has some hundred. Those that were silent for `HISTORY`
make room for others."""

_MOST_IN_ALL = 200_000
"""Transforms kept of all frames, some 50 MB: ten seconds of a hundred frames at 200 Hz. Where
there are more, frames keep `_FEW` of theirs."""

_FEW = 2
"""Transforms between which one is interpolated."""

_LOOK_AGAIN = 1_000_000_000
"""Nanoseconds after which silent frames are looked for again."""

_SMALL_ANGLE = 1e-9
"""rad: below it a turn is as good as none, and slerp would divide by nothing."""

Pose = NDArray[np.float64]


class MissingTransformError(SceneGraphError, LookupError):
    """A chain of transforms that is not there, with the place where it ends."""


class Placed(NamedTuple):
    """A frame in another one, as of ``stamp`` (ns); STATIC where nothing between them moves."""

    X: Pose
    stamp: int


@dataclass
class _Edge:
    """A frame in its parent: ``stamps`` ascend; one without a time is static."""

    parent: str
    is_static: bool
    stamps: list[int] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)

    def put(self, stamp: int, X: Pose, most: int) -> bool:
        """Keep a pose, and ``most`` in all; False for one that is kept already."""
        if self.is_static:
            is_new = not (self.poses and np.array_equal(self.poses[0], X))
            self.stamps[:], self.poses[:] = [stamp], [X]
            return is_new
        i = bisect_left(self.stamps, stamp)
        if i < len(self.stamps) and self.stamps[i] == stamp:
            return False
        self.stamps.insert(i, stamp)
        self.poses.insert(i, X)
        first = bisect_left(self.stamps, self.stamps[-1] - HISTORY)
        first = max(first, len(self.stamps) - most)
        del self.stamps[:first], self.poses[:first]
        return i >= first

    def at(self, stamp: int) -> Pose | None:
        """Return the pose at a time, interpolated between two; None before the first."""
        if self.is_static or stamp >= self.stamps[-1]:
            return self.poses[-1]
        i = bisect_left(self.stamps, stamp)
        if self.stamps[i] == stamp:
            return self.poses[i]
        if i == 0:
            return None
        before, after = self.stamps[i - 1], self.stamps[i]
        return pose_between(self.poses[i - 1], self.poses[i], (stamp - before) / (after - before))


def pose_between(X1: Pose, X2: Pose, t: float) -> Pose:
    """Return the pose at t in [0, 1] between two: a line, and a turn at one speed (slerp)."""
    a, b = quaternions_from_poses(np.stack([X1, X2]))
    b = b if product(a, b) >= 0.0 else -b
    angle = 2.0 * arc_sine(min(1.0, 0.5 * length(a - b)))
    u, v = 1.0 - t, t
    if angle > _SMALL_ANGLE:
        u, v = (sine_cosine(w * angle)[0] / sine_cosine(angle)[0] for w in (u, v))
    q = u * a + v * b
    p = (1.0 - t) * X1[:3, 3] + t * X2[:3, 3]
    return poses_from_quaternions(p[np.newaxis], (q / length(q))[np.newaxis])[0]


class TfTree:
    """All transforms that were heard.

    Chains are composed at the newest time of which each moving transform in them is known
    (``interpolates``), or of the newest of each.
    """

    def __init__(self, *, interpolates: bool = True) -> None:
        self.interpolates = interpolates
        self._edges: dict[str, _Edge] = {}
        self._count = 0
        self._looked = -_LOOK_AGAIN

    def newest(self, frame: str) -> int | None:
        """Return the newest stamp of a frame in its parent, None where it was not heard."""
        edge = self._edges.get(frame)
        return None if edge is None or not edge.stamps else edge.stamps[-1]

    def put(self, frame: str, parent: str, X: Pose, stamp: int, *, is_static: bool) -> bool:
        """Take a transform; tell whether it is new.

        A parent that is another than before, and newer, takes the place of all before.
        """
        edge = self._edges.get(frame)
        if edge is None or edge.parent != parent or edge.is_static != is_static:
            if edge is not None and edge.stamps and stamp < edge.stamps[-1] and not is_static:
                return False
            if edge is None and len(self._edges) >= _MOST_FRAMES:
                if not is_static:  # else the stamp is no time
                    self._drop_silent(stamp)
                if len(self._edges) >= _MOST_FRAMES:
                    return False
            self._count -= 0 if edge is None else len(edge.stamps)
            edge = self._edges[frame] = _Edge(parent, is_static)
        before = len(edge.stamps)
        is_new = edge.put(stamp, X, _MOST_KEPT if self._count < _MOST_IN_ALL else _FEW)
        self._count += len(edge.stamps) - before
        return is_new

    def _drop_silent(self, stamp: int) -> None:
        """Forget frames that move and were not heard for `HISTORY` before a stamp."""
        if stamp - self._looked < _LOOK_AGAIN:
            return
        self._looked = stamp
        oldest = stamp - HISTORY
        for frame, edge in list(self._edges.items()):
            if not edge.is_static and edge.stamps[-1] < oldest:
                self._count -= len(edge.stamps)
                del self._edges[frame]

    def forget(self, after: int) -> None:
        """Forget moving transforms stamped later than ``after``: the clock jumped back."""
        self._looked = min(self._looked, after)
        for frame, edge in list(self._edges.items()):
            if edge.is_static:
                continue
            last = bisect_left(edge.stamps, after + 1)
            self._count -= len(edge.stamps) - last
            del edge.stamps[last:], edge.poses[last:]
            if not edge.stamps:
                del self._edges[frame]

    def place(self, frame: str, base: str) -> Placed:
        """Return the pose of a frame in another one, ``base``.

        Raises MissingTransformError naming the frame whose transform is not there.
        """
        up, down = self._chain(frame, base)
        moving = [self._edges[f] for f in (*up, *down) if not self._edges[f].is_static]
        stamp = min((edge.stamps[-1] for edge in moving), default=STATIC)
        at = stamp if self.interpolates else STATIC
        return Placed(compose(inverse(self._product(down, at)), self._product(up, at)), stamp)

    def _product(self, chain: list[str], stamp: int) -> Pose:
        """Return the pose of the first of a chain of frames in the parent of its last."""
        result = np.eye(4)
        for frame in reversed(chain):
            edge = self._edges[frame]
            X = edge.at(stamp)
            if X is None:
                lag = (edge.stamps[0] - stamp) * 1e-9
                raise MissingTransformError(
                    f"{quoted(frame)} in {quoted(edge.parent)} is not known {lag:.3f} s before "
                    "its oldest transform, of when the chain's slowest is"
                )
            result = product(result, X)
        return result

    def _chain(self, frame: str, base: str) -> tuple[list[str], list[str]]:
        """Return the frames from ``frame``, and from ``base``, below the first that both have."""
        up, down = self._ancestors(frame), self._ancestors(base)
        common = next((f for f in up if f in set(down)), None)
        if common is None:
            raise MissingTransformError(self._gap(frame, base, up[-1], down[-1]))
        return up[: up.index(common)], down[: down.index(common)]

    def _ancestors(self, frame: str) -> list[str]:
        """Return a frame and all above it; a loop ends where it begins."""
        found = {frame: None}
        while frame in self._edges and (frame := self._edges[frame].parent) not in found:
            found[frame] = None
        return list(found)

    def _gap(self, frame: str, base: str, top: str, other: str) -> str:
        if top == frame:
            why = f"no transform places {quoted(frame)} in anything"
        else:
            why = f"{quoted(frame)} hangs on {quoted(top)}, which no transform places in anything"
        if other != base:
            why += f", and {quoted(base)} on {quoted(other)}"
        return f"no chain of transforms from {quoted(base)} to {quoted(frame)}: {why}"
