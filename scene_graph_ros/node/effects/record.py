"""Diagnostics of a recording; the recording itself begins before there are effects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["Record"]


class Record:
    """Reports the recording that the node's parameter asks for."""

    def __init__(self, host: Host) -> None:
        self._recorder = host.recorder

    def is_heard(self) -> bool:
        """Tell that nothing is to be prepared for it."""
        return False

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing."""

    def has_work(self) -> bool:
        """Tell that updates do nothing for it."""
        return False

    def update(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: inputs and outputs are recorded where they pass."""

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing: the recording goes on until the node is cleaned up."""

    def failure(self) -> str:
        """Say why the recording ended before its time, "" where it did not."""
        return "" if self._recorder is None else self._recorder.failure()

    def stale(self) -> str:
        """Say why nothing more is recorded, "" while it is."""
        return "" if self._recorder is None else self._recorder.end()

    def recent_seconds(self) -> list[float]:
        """Return nothing: it takes no time of updates that could be told apart."""
        return []

    def count(self) -> int:
        """Return the number of messages recorded."""
        return 0 if self._recorder is None else self._recorder.counters()["messages"]

    def counters(self) -> Mapping[str, Any]:
        """Return counts of the records, and the file."""
        return {} if self._recorder is None else self._recorder.counters()
