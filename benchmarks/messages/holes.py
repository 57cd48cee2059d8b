"""Holes in the contacts, with each transport, while participants come and go.

The rigs of all transports run side by side, so that what else the machine does hits them alike.
Each is driven by a process of its own, since Fast DDS reads its profiles once:
``python -m benchmarks.messages.holes TRANSPORT SECONDS``.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time

import numpy as np
import rclpy
from tqdm import tqdm

from benchmarks.messages.processes import cpu_seconds, ROOT
from benchmarks.messages.report import Holes
from benchmarks.messages.sustained import Rig, rig
from scene_graph_msgs.msg import ContactArray

__all__ = ["TRANSPORTS", "holes"]

TRANSPORTS: dict[str, dict[str, str]] = {
    "shared memory": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
    "UDP": {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "config" / "udp_on_this_machine.xml"),
    },
}
"""The environment that makes each what rmw_fastrtps uses."""

_FRAMES = 100
_RATE = 100.0
_STAY, _AWAY = (0.5, 3.0), (0.5, 3.0)
"""Seconds between which a visitor stays, and is away."""

_HOLE = 0.1
"""Seconds between two messages of contacts from which on it is a hole, ten times the usual."""


def holes(is_quick: bool, seconds: float = 0.0) -> list[Holes]:
    """Print how often contacts stayed away for more than a tenth of a second."""
    seconds = seconds or (10.0 if is_quick else 3600.0)
    command = [sys.executable, "-m", "benchmarks.messages.holes"]
    drivers = {
        name: subprocess.Popen(
            [*command, name, str(seconds)],
            env={**os.environ, **environment},
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        )
        for name, environment in TRANSPORTS.items()
    }
    begin = time.monotonic()
    with tqdm(total=round(seconds), desc="holes", unit="s", leave=False) as bar:
        while any(driver.poll() is None for driver in drivers.values()):
            time.sleep(0.5)
            bar.update(min(round(time.monotonic() - begin), bar.total) - bar.n)
    rows = []
    for name, driver in drivers.items():
        output, _ = driver.communicate()
        if driver.returncode:
            raise RuntimeError(f"the rig of {name} ended with {driver.returncode}")
        rows.append(Holes(name, **json.loads(output.splitlines()[-1])))
    print(f"gaps of more than {_HOLE:g} s in contacts at {_RATE:g} Hz, participants coming, going")
    for row in rows:
        print(
            f"{row.transport:14} {row.seconds:6.0f} s, {row.visits:5} visits: {len(row.gaps):3}"
            f" holes, longest {1e3 * max(row.gaps, default=0.0):4.0f} ms; latency"
            f" {1e3 * row.median:.2f} ms, 99 % {1e3 * row.high:.2f} ms; {row.share:.2f} of a core"
        )
    return rows


def _visit(domain: int, random_state: random.Random) -> None:
    """Come as a participant that listens to contacts, stay for a while, and go."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node("visitor", context=context)
    node.create_subscription(ContactArray, "/scene_graph/contacts", lambda message: None, 1)
    time.sleep(random_state.uniform(*_STAY))
    node.destroy_node()
    rclpy.shutdown(context=context)


def _drive(one: Rig, seconds: float) -> dict[str, object]:
    """Send poses for so long, with visitors, and return what a row has."""
    random_state, visits = random.Random(0), 0
    one.run(_RATE, 2.0)
    one.listener.arrivals.clear()
    end = time.monotonic() + seconds
    used = cpu_seconds(one.node.pid)
    one.sender.begin(_RATE, seconds)
    while time.monotonic() < end - _STAY[1]:
        time.sleep(random_state.uniform(*_AWAY))
        _visit(one.isolation.domain, random_state)
        visits += 1
    one.sender.end()
    share = (cpu_seconds(one.node.pid) - used) / seconds
    stamps, arrivals = np.array(one.listener.arrivals).T * 1e-9
    gaps = np.diff(arrivals)
    median, high = np.percentile(arrivals - stamps, (50, 99))
    return {
        "seconds": seconds,
        "visits": visits,
        "messages": len(arrivals),
        "gaps": gaps[gaps > _HOLE].tolist(),
        "median": median,
        "high": high,
        "share": share,
    }


if __name__ == "__main__":
    _, duration = sys.argv[1:]
    with rig(_FRAMES, is_ordinary=False) as driven:
        print(json.dumps(_drive(driven, float(duration))))
