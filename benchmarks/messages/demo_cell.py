"""The demo's cell: a Panda by joint positions and objects by poses, over DDS."""

from __future__ import annotations

import subprocess
import time
from typing import Any

import numpy as np

from benchmarks.messages.listener import Listener
from benchmarks.messages.processes import cpu_seconds, isolated, Isolation, ROOT

__all__ = ["demo_processes", "panda"]

SCENE = ROOT / "config" / "scenes" / "panda_cell.yaml"


def demo_processes(isolation: Isolation, rate: float) -> subprocess.Popen[Any]:
    """Start the node with the demo's scene, a Panda and moving objects; return the node."""
    node = isolation.start_node(SCENE)
    for name in ("panda_robot", "moving_objects"):
        isolation.start_script(ROOT / "examples" / f"{name}.py", "--rate", str(rate))
    return node


def panda(is_quick: bool) -> None:
    """Print the latency of the demo."""
    seconds, rate = (3.0, 100.0) if is_quick else (20.0, 100.0)
    with isolated() as isolation:
        node = demo_processes(isolation, rate)
        listener = Listener(isolation.domain, with_markers=True)
        try:
            listener.wait_for_contacts(isolation.check)
            while listener.arrivals[-1][0] == 0:
                time.sleep(0.01)
            time.sleep(3.0)
            isolation.check()
            listener.arrivals.clear()
            used, begin = cpu_seconds(node.pid), time.monotonic()
            time.sleep(seconds)
            elapsed = time.monotonic() - begin
            share = (cpu_seconds(node.pid) - used) / elapsed
            first: dict[int, int] = {}
            for stamp, arrival in list(listener.arrivals):
                first.setdefault(stamp, arrival)
            latencies = np.array([arrival - stamp for stamp, arrival in first.items()]) * 1e-6
        finally:
            listener.close()
    median, high = np.percentile(latencies, (50, 99))
    print(f"Panda and objects at {rate:g} Hz each, {len(latencies) / elapsed:.0f} updates/s")
    print(
        f"pose sent to contacts received: {median:.2f} ms median, {high:.2f} ms 99th percentile,"
    )
    print(f"{latencies.max():.2f} ms worst; the node used {share:.2f} of a core")
