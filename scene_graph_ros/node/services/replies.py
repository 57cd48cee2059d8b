"""Responses' statuses: how answers and refusals are told, and how many there were."""

from __future__ import annotations

import traceback
from typing import Any

from msg_adapters.stamps import stamp_to_msg
from msg_adapters.status import ok_status, status_from_exception
from scene_graph_msgs.msg import Status
import scene_graph_msgs.srv
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.services.request_counts import RequestCounts
from scene_graph_ros.node.world.world import World, WorldSnapshot

__all__ = ["Replies"]


class Replies:
    """Fills the status of responses, and counts them."""

    def __init__(self, world: World, logger: Any) -> None:
        """Refusals name the scene of ``world``; faults of the node go to ``logger``."""
        self._world, self._logger = world, logger
        self.counts = RequestCounts()

    @staticmethod
    def empty(name: str) -> Any:
        """Return the response of a service before it is filled."""
        return getattr(scene_graph_msgs.srv, name).Response()

    def finish(self, response: Any, snapshot: WorldSnapshot) -> None:
        """Fill the status, the version and the stamp of an answer about ``snapshot``."""
        response.status = ok_status()
        response.scene_version = snapshot.scene_version
        if hasattr(response, "stamp"):
            response.stamp = stamp_to_msg(snapshot.stamp)
        self.counts.answered()

    def refuse(self, name: str, response: Any, error: Exception) -> Any:
        """Fill an empty response, or result, with the status of an error in the call ``name``."""
        self.counts.was_refused()
        response.status = status_from_exception(error)
        if hasattr(response, "scene_version"):
            response.scene_version = self._world.snapshot.scene_version
        if response.status.code == Status.INTERNAL_ERROR:
            self._logger.error(f"{name} failed:\n{_details(error)}")
        return response


def _details(error: Exception) -> str:
    """Return an error's traceback and text, quoted safely."""
    where = "".join(traceback.format_tb(error.__traceback__))
    return f"{where}{type(error).__name__}: {quoted(str(error))}"
