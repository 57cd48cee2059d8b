"""How processes of tests talk: by UDP on this machine alone, as the demo does.

By default Fast DDS shares memory, with locks in it, among all that is on the machine. Tests stop
and kill processes, and whoever waits for a lock of such a process waits for ever, in a call that
no signal ends.
"""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["SHARED_MEMORY", "UDP", "use_udp"]

_ROOT = Path(__file__).parents[2]

UDP = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
    "FASTRTPS_DEFAULT_PROFILES_FILE": str(_ROOT / "config" / "udp_on_this_machine.xml"),
}
"""Variables of the environment: with LOCALHOST rmw_fastrtps would choose transports itself."""

SHARED_MEMORY = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "FASTRTPS_DEFAULT_PROFILES_FILE": str(_ROOT / "scene_graph_ros" / "node" / "fast_dds.xml"),
}
"""What a node talks by that is started by hand and kept to this machine."""


def use_udp() -> None:
    """Have this process, and those that it starts, talk so."""
    os.environ.update(UDP)
