"""Holes in the contacts, with each transport, while participants come and go.

The rigs of all transports run side by side, so that what else the machine does hits them alike.
Each is driven by a process of its own, since Fast DDS reads its profiles once:
``python -m benchmarks.messages.holes TRANSPORT SECONDS``.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
from tqdm import tqdm

from benchmarks.messages.processes import cpu_seconds, Isolation, ROOT
from benchmarks.messages.report import Holes
from benchmarks.messages.sustained import Rig, rig

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
_HOLE = 0.25
"""Seconds between two messages of contacts from which on it is a hole, 25 times the usual."""


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
    try:
        with tqdm(total=round(seconds), desc="holes", unit="s", leave=False) as bar:
            while any(driver.poll() is None for driver in drivers.values()):
                time.sleep(0.5)
                bar.update(min(round(time.monotonic() - begin), bar.total) - bar.n)
                for name, driver in drivers.items():
                    if driver.poll():
                        raise RuntimeError(f"the rig of {name} ended with {driver.returncode}")
    finally:
        for driver in drivers.values():
            driver.terminate()
    rows = []
    for name, driver in drivers.items():
        output, _ = driver.communicate()
        rows.append(Holes(name, **json.loads(output.splitlines()[-1])))
    print(f"gaps of more than {_HOLE:g} s in contacts at {_RATE:g} Hz, participants coming, going")
    for row in rows:
        print(
            f"{row.transport:14} {row.seconds:6.0f} s, {row.visits:5} visits,"
            f" {row.crashes} crashes of visitors: {len(row.gaps):3}"
            f" holes, longest {1e3 * max(row.gaps, default=0.0):4.0f} ms; latency"
            f" {1e3 * row.median:.2f} ms, 99 % {1e3 * row.high:.2f} ms; {row.share:.2f} of a core"
        )
    return rows


class _Visitors:
    """A process whose participants come and go; another takes its place where it crashes."""

    def __init__(self, isolation: Isolation) -> None:
        self._isolation = isolation
        self.visits = self.crashes = 0
        self._is_over = False
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._is_over:
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
            self._process = self._isolation.start("benchmarks.messages.visitor", **pipes)
            for _ in self._process.stdout:
                self.visits += 1
            self.crashes += self._process.wait() != 0

    def close(self) -> None:
        """Let the last visit end."""
        self._is_over = True
        self._process.stdin.close()
        self._thread.join()


def _drive(one: Rig, seconds: float) -> dict[str, object]:
    """Send poses for so long, with visitors, and return what a row has."""
    one.run(_RATE, 2.0)
    one.listener.arrivals.clear()
    used = cpu_seconds(one.node.pid)
    one.sender.begin(_RATE, seconds)
    visitors = _Visitors(one.isolation)
    one.sender.end()
    visitors.close()
    share = (cpu_seconds(one.node.pid) - used) / seconds
    stamps, arrivals = np.array(one.listener.arrivals).T * 1e-9
    gaps = np.diff(arrivals)
    median, high = np.percentile(arrivals - stamps, (50, 99))
    return {
        "seconds": seconds,
        "visits": visitors.visits,
        "crashes": visitors.crashes,
        "messages": len(arrivals),
        "gaps": gaps[gaps > _HOLE].tolist(),
        "median": median,
        "high": high,
        "share": share,
    }


if __name__ == "__main__":
    _, duration = sys.argv[1:]
    # So that its processes are ended with it.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with rig(_FRAMES, is_ordinary=False) as driven:
        print(json.dumps(_drive(driven, float(duration))))
