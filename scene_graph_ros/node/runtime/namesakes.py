"""Notices other nodes of the same full name: both would answer each request, one of them first."""

from __future__ import annotations

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType

from scene_graph_ros.node.runtime.guarded import GuardedNode

__all__ = ["Namesakes"]

_PERIOD = 1.0
"""Seconds between two looks at the names of all nodes, which take less than a millisecond."""


class Namesakes:
    """Counts the other nodes that have a node's full name, and warns where there are more."""

    def __init__(self, node: GuardedNode) -> None:
        """Look as long as there is the node."""
        self.count = 0
        self._node = node
        self._timer = node.create_timer(
            _PERIOD,
            node.survives("looking for nodes of the same name", self._look),
            callback_group=MutuallyExclusiveCallbackGroup(),
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    @property
    def problem(self) -> str:
        """The problem in a sentence, "" if there is none."""
        if not self.count:
            return ""
        return f"{self.count} more of the name '{self._node.get_fully_qualified_name()}'"

    def _look(self) -> None:
        own = self._node.get_fully_qualified_name()
        before, self.count = self.count, self._node.get_fully_qualified_node_names().count(own) - 1
        logger = self._node.get_logger()
        if self.count > before:
            logger.warning(
                f"another node is called '{own}', too (or one that ended without saying so): both "
                "answer every request, so that answers come from either world and edits are "
                "refused at random (NOT_OWNER); give one another name or namespace: "
                "-r __node:=NAME, -r __ns:=/NAMESPACE"
            )
        elif self.count < before:
            logger.info(f"{before - self.count} of the nodes called '{own}', too, went")
