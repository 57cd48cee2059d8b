"""The stamps that a message may have: not too old, not in the future, not out of order."""

from __future__ import annotations

from typing import NamedTuple

from msg_adapters.stamps import EARLIEST, LATEST
from scene_graph_ros.geometry.spatial.record_kernels import (
    EARLY,
    IN_TIME,
    judge_time,
    OUT_OF_ORDER,
)
from scene_graph_ros.node.world.faults import Fault

__all__ = ["TimeLimits"]


class TimeLimits(NamedTuple):
    """Nanoseconds of the node's clock: the time now, and how old and how new a pose may be.

    ``now`` of 0 (simulated time that has not begun) switches both checks off, ``max_age`` of 0
    that of the age. A stamp that no answer could have is never right.
    """

    now: int
    max_age: int
    max_lead: int

    def bounds(self) -> tuple[int, int, int]:
        """Return the time now, the earliest and the latest stamp of a pose that may be applied."""
        now, max_age, max_lead = self
        if now <= 0:
            return now, EARLIEST, LATEST
        earliest = max(now - max_age, EARLIEST) if max_age > 0 else EARLIEST
        return now, earliest, min(now + max_lead, LATEST)

    def of_static(self) -> TimeLimits:
        """Return the limits of static poses, which are never too old."""
        return self._replace(max_age=0)

    def problem(self, stamp: int, newest: int) -> tuple[Fault, str] | None:
        """Return the fault of a pose that would replace one of ``newest``, or None.

        The sentence is to follow "a pose".
        """
        _, earliest, latest = self.bounds()
        status = judge_time(stamp, newest, earliest, latest)
        return None if status == IN_TIME else self.describe(status, stamp, newest)

    def describe(self, status: int, stamp: int, newest: int) -> tuple[Fault, str]:
        """Return the verdict of `judge_time` on a stamp, as `problem` does."""
        if status == OUT_OF_ORDER:
            earlier = (newest - stamp) * 1e-9
            return Fault.OUT_OF_ORDER, (
                f"is stamped {earlier:.3f} s before what it would replace; stamps of the same "
                "thing must not go back"
            )
        if self.now <= 0:
            return Fault.FUTURE, f"stamped {stamp} ns is later than any message can say"
        lag = f"stamped {(self.now - stamp) * 1e-9:.3f} s ago is "
        if status == EARLY:
            return Fault.STALE, lag + f"older than max_pose_age, {self.max_age * 1e-9:g} s"
        lead = f"stamped {(stamp - self.now) * 1e-9:.3f} s in the future is "
        return Fault.FUTURE, lead + f"beyond max_pose_lead, {self.max_lead * 1e-9:g} s"
