"""Whether a goal's time is over, and its feedback meanwhile; for paths through regions."""

from __future__ import annotations

import time

import numpy as np

from scene_graph_msgs.action import PlanPath
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.services.plan_goals import CancelledError
from scene_graph_ros.planning import PlanProgress

__all__ = ["NoPlanError", "PlanWatch"]

_F, _STATES = PlanPath.Result, PlanPath.Feedback

_TURN = 0.05
"""Seconds between two feedbacks."""


class NoPlanError(Exception):
    """There is no trajectory; with the number of the failure."""

    def __init__(self, failure: int, reason: str) -> None:
        super().__init__(reason)
        self.failure = failure


class PlanWatch:
    """Whether it is time to end, and the feedback meanwhile."""

    def __init__(self, goal: Goal, seconds: float) -> None:
        self._goal, self._begin, self._most = goal, time.monotonic(), seconds
        self._told = -_TURN
        self.state = _STATES.CHECKING

    @property
    def seconds(self) -> float:
        """Since its turn has come."""
        return time.monotonic() - self._begin

    @property
    def left(self) -> float:
        """Seconds until the end."""
        return max(self._most - self.seconds, 0.0)

    def turn_to(self, state: int) -> None:
        """Give feedback of the next state."""
        self.state, self._told = state, -_TURN
        self.look()

    def look(self) -> None:
        """Tell of it now and then; raises CancelledError, or NoPlanError where it is late."""
        seconds = self.seconds
        if self._goal.is_cancelled:
            raise CancelledError(f"cancelled after {seconds:.3g} s, {_DOING[self.state]}")
        if seconds > self._most:
            words = f"no trajectory was found within {self._most:.10g} s, {_DOING[self.state]}"
            raise NoPlanError(_F.TIMEOUT, words)
        if seconds - self._told >= _TURN:
            self._told = seconds
            self._goal.tell(PlanPath.Feedback(state=self.state, seconds=seconds))

    def follow(self, progress: PlanProgress) -> None:
        """Look, and tell how far a search has come."""
        if self._goal.is_cancelled:
            raise CancelledError.of_search(progress)
        sizes = np.array(progress.tree_sizes, dtype=np.uint64)
        self._goal.tell(
            PlanPath.Feedback(
                state=progress.stage.value,
                seconds=self.seconds,
                tree_sizes=sizes,
                edges=progress.edges,
            )
        )


_DOING = {
    _STATES.CHECKING: "while start and goal were looked at",
    _STATES.GROWING: "while regions grew",
    _STATES.SOLVING: "while a way through the regions was looked for",
    _STATES.TIMING: "while the trajectory was made and proven",
}
