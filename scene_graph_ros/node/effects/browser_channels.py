"""What clients of the view in a browser are offered: the node's own topics.

Imported only where the parameter `browser` asks for it.
"""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node

from msg_adapters.definitions import definition_with_parts
from scene_graph_ros.views.browser.channels import Channels

__all__ = ["open_channels"]


def open_channels(node: Node, wanted: Callable[[], None]) -> Channels:
    """Return what each topic of ``node`` is to be offered in; ``wanted`` asks for an update."""
    clock = node.get_clock()
    return Channels(
        node.get_fully_qualified_name(),
        definition_with_parts,
        clock=lambda: max(clock.now().nanoseconds, 0),
        is_simulated=lambda: bool(clock.ros_time_is_active),
        wanted=wanted,
    )
