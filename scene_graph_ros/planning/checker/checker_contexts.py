"""Places of a checker's robots that one thread each may hold on to."""

from __future__ import annotations

from collections.abc import Callable
import os
import threading
from typing import Any
import weakref

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import inverse
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.planning.checker.checker_state import CheckerState
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["CheckerContexts", "CollisionCheckerContext", "checked_parallelism"]


@one_line("q")
class CollisionCheckerContext:
    """Positions of a checker's robots, and the scene with them there.

    The scene is the checker's at the time of asking, with the shapes that were added until then.
    One thread at a time may set positions.
    """

    def __init__(self, state: Callable[[], CheckerState]) -> None:
        self._state = state
        self._q = _frozen(state().plan.tree.zero_configuration())

    @property
    def q(self) -> NDArray[np.float64]:
        """Positions ``(nq,)``, which nobody writes to."""
        return self._q

    def set_positions(self, q: ArrayLike) -> None:
        """Set the positions ``(nq,)``. Raises KinematicTreeError for another shape or type."""
        (configuration,) = self._state().plan.tree.checked_configurations(q)
        self._q = _frozen(configuration.copy())

    def query_object(self) -> QueryObject:
        """Return the query object of the scene with the robots there, now and later alike."""
        return QueryObject(moved_snapshot(self._state(), self._q))


class CheckerContexts:
    """The contexts of a checker: some that have a number, and all others that are still in use."""

    def __init__(self, count: int, state: Callable[[], CheckerState]) -> None:
        self.count = count
        self._state = state
        self._numbered: dict[int, CollisionCheckerContext] = {}
        self._standalone: weakref.WeakSet[CollisionCheckerContext] = weakref.WeakSet()
        self._lock = threading.RLock()

    def numbered(self, number: Any) -> CollisionCheckerContext:
        """Return one by its number, the first for None. Raises CollisionCheckerError."""
        row = 0 if number is None else number
        is_number = isinstance(row, (int, np.integer)) and not isinstance(row, bool)
        if not is_number or not 0 <= row < self.count:
            raise CollisionCheckerError(
                f"context_number must be from 0 to {self.count - 1}, not {quoted(number)}"
            )
        with self._lock:
            return self._numbered.setdefault(int(row), CollisionCheckerContext(self._state))

    def make_standalone(self) -> CollisionCheckerContext:
        """Return one for a thread of one's own."""
        result = CollisionCheckerContext(self._state)
        with self._lock:
            self._standalone.add(result)
        return result

    def own(self, context: Any) -> CollisionCheckerContext:
        """Return a context after checking that it is one of these."""
        if not isinstance(context, CollisionCheckerContext):
            raise CollisionCheckerError(
                f"model_context must be a CollisionCheckerContext, not {quoted(context)}"
            )
        with self._lock:
            if context in self._standalone or context in self._numbered.values():
                return context
        raise CollisionCheckerError("model_context is another checker's")

    def all(self) -> list[CollisionCheckerContext]:
        """Return all that are there, by number first."""
        numbered = [self.numbered(number) for number in range(self.count)]
        with self._lock:
            return numbered + list(self._standalone)


def checked_parallelism(parallelism: Any, supports_parallel_checking: bool) -> int:
    """Return the number of contexts with numbers: one for each processor, or as many as asked for.

    Where threads cannot share the work it is 1. Raises CollisionCheckerError unless it is a whole
    number from 1 on.
    """
    count = os.cpu_count() or 1 if parallelism is None else parallelism
    is_number = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
    if not is_number or count < 1:
        raise CollisionCheckerError(
            "implicit_context_parallelism must be a whole number from 1 on, not"
            f" {quoted(parallelism)}"
        )
    return int(count) if supports_parallel_checking else 1


def moved_snapshot(state: CheckerState, q: NDArray[np.float64]) -> Snapshot:
    """Return a checker's scene with the robots' links where q ``(nq,)`` puts them."""
    snapshot, inspector = state.snapshot, state.snapshot.inspector
    X_WLs = state.plan.tree.link_poses(q)
    world = inspector.world_frame_id()
    X_WF: dict[FrameId, NDArray[np.float64]] = {world: np.eye(4)}

    def in_world(frame: FrameId) -> NDArray[np.float64]:
        if frame not in X_WF:
            link = state.links.get(int(frame))
            if link is not None:
                X_WF[frame] = X_WLs[link]
            else:
                X_WP = in_world(inspector.get_parent_frame(frame))
                X_WF[frame] = product(X_WP, snapshot.pose_in_parent(frame))
        return X_WF[frame]

    poses: dict[FrameId, Any] = {}
    for frame in inspector.get_all_frame_ids():
        if int(frame) in state.links and frame != world:
            X_WP = in_world(inspector.get_parent_frame(frame))
            poses[frame] = product(inverse(X_WP), in_world(frame))
    return snapshot.with_frame_poses(poses)


def _frozen(q: NDArray[np.float64]) -> NDArray[np.float64]:
    q.setflags(write=False)
    return q
