"""How processes of tests talk: by UDP on this machine alone, as the demo does.

By default Fast DDS shares memory, with locks in it, among all that is on the machine. Tests stop
and kill processes, and whoever waits for a lock of such a process waits for ever, in a call that
no signal ends.
"""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["BY_HAND", "PROFILES", "TRANSPORTS", "use_transports"]

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"

_UDP = {
    # With LOCALHOST rmw_fastrtps would choose transports itself; the file keeps to this machine.
    RANGE: "SYSTEM_DEFAULT",
    PROFILES: str(Path(__file__).parents[2] / "config" / "udp_on_this_machine.xml"),
}
_IS_FAST_DDS = os.environ.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp").startswith("rmw_fastrtps")

TRANSPORTS = _UDP if _IS_FAST_DDS else {RANGE: "LOCALHOST"}
"""Variables of the environment; other middleware does not read that file."""

BY_HAND: dict[str, str | None] = {RANGE: "LOCALHOST", PROFILES: None}
"""What a node is given that is started by hand and kept to this machine: no file of profiles."""


def use_transports() -> None:
    """Have this process, and those that it starts, talk so."""
    os.environ.update(TRANSPORTS)
