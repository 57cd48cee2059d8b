"""Channels for clients of the view in a browser: the node's own topics.

Imported only where the parameter `browser` asks for it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
import threading
import time

from rclpy.node import Node

from msg_adapters.definitions import definition_with_parts
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.browser.assets import Asset, SceneAssets
from scene_graph_ros.views.browser.channels import Channels
from scene_graph_ros.views.browser.seldom import Seldom

__all__ = ["open_channels"]

_MOMENT = 0.1
"""Seconds from one update that clients ask for to the next: those who come meanwhile share one."""

_PERIOD = 0.5
"""Seconds from one look for the scene's files to the next."""


def open_channels(
    node: Node, wanted: Callable[[], None], newest: Callable[[], WorldSnapshot]
) -> Channels:
    """Return the channels of the topics of ``node``; ``wanted`` asks for an update.

    Files of meshes are offered, too, of the ``newest`` snapshot's scene.
    """
    clock = node.get_clock()
    return Channels(
        node.get_fully_qualified_name(),
        definition_with_parts,
        clock=lambda: max(clock.now().nanoseconds, 0),
        is_simulated=lambda: bool(clock.ros_time_is_active),
        wanted=Seldom(wanted, _MOMENT),
        assets=_NewestAssets(newest).find,
    )


class _NewestAssets:
    """The files of the scene that there is now, looked for when the first is asked for."""

    def __init__(self, newest: Callable[[], WorldSnapshot]) -> None:
        self._newest = newest
        self._lock = threading.Lock()
        self._known: tuple[int, SceneAssets] | None = None
        self._last = float("-inf")

    def find(self, address: str) -> Asset:
        """Return the file of an address. Raises AssetError."""
        # One client after the other: what is looked up for one is there for the next.
        with self._lock:
            known = self._known
            if known is None or known[0] != self._newest().scene_version:
                # A scene may change all the time, and looking takes milliseconds.
                time.sleep(max(self._last + _PERIOD - time.monotonic(), 0.0))
                snapshot = self._newest()
                known = (snapshot.scene_version, SceneAssets(snapshot.inspector, _addressing))
                self._known, self._last = known, time.monotonic()
            return known[1].find(address)


def _addressing() -> Callable[[Path], str]:
    """Return the function from a mesh's file to its address in markers."""
    # Only clients that ask for files need it.
    from msg_adapters.meshes import resource_uri
    from scene_graph_ros.node.effects.markers import package_shares

    return partial(resource_uri, package_shares=package_shares())
