"""End to end: the highest pose rate that contacts keep up with, latency, share of a core."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from dataclasses import dataclass
from pathlib import Path
import subprocess
import time
from typing import Any

import numpy as np

from benchmarks.messages.listener import Listener
from benchmarks.messages.processes import cpu_seconds, isolated, Isolation, Sender
from benchmarks.messages.scene import scene_text

__all__ = ["Measured", "Rig", "highest_rate", "rig"]

_WARM_UP = 60
"""Messages before anything is measured."""

_SETTLE = 0.5
"""Seconds that late contacts are waited for."""

_KEPT_UP = 0.95
"""Part of the poses whose own contacts must come for a rate to count as sustained."""

_LARGEST_RATE = 8000.0


@dataclass(frozen=True)
class Measured:
    """One run at one rate."""

    rate: float
    sent: int
    answered: int
    latencies: np.ndarray
    """Seconds from the stamp of poses, taken when they are sent, to the receipt of contacts."""
    share: float
    contacts: int
    markers: int
    seconds: float

    @property
    def is_sustained(self) -> bool:
        """Whether contacts kept up with poses."""
        return self.answered >= _KEPT_UP * self.sent

    def latency(self) -> str:
        """Return median, 99th percentile and worst in milliseconds."""
        if not len(self.latencies):
            return "no contacts came"
        median, high = np.percentile(self.latencies, (50, 99)) * 1e3
        return f"{median:7.2f} {high:8.2f} {self.latencies.max() * 1e3:8.2f}"


class Rig:
    """A node, a sender and a listener."""

    def __init__(
        self, isolation: Isolation, node: subprocess.Popen[Any], sender: Sender, listener: Listener
    ) -> None:
        self.isolation, self.node = isolation, node
        self.sender, self.listener = sender, listener

    def run(self, rate: float, seconds: float) -> Measured:
        """Send poses for a while and collect their contacts."""
        self.isolation.check()
        listener = self.listener
        listener.arrivals.clear()
        markers, begin = listener.markers, time.time_ns()
        used, started = cpu_seconds(self.node.pid), time.monotonic()
        self.sender.begin(rate, seconds)
        sent = self.sender.end()
        elapsed = time.monotonic() - started
        share = (cpu_seconds(self.node.pid) - used) / elapsed
        time.sleep(_SETTLE)
        # Contacts are published again while nothing moves: the first of a stamp counts.
        first: dict[int, int] = {}
        for stamp, arrival in list(listener.arrivals):
            if stamp >= begin:
                first.setdefault(stamp, arrival)
        latencies = np.array([(arrival - stamp) * 1e-9 for stamp, arrival in first.items()])
        count = listener.contacts()
        return Measured(
            rate, sent, len(first), latencies, share, count, listener.markers - markers, elapsed
        )

    def warm_up(self) -> None:
        """Wait for the first contacts, then let everything be used once."""
        self.listener.wait_for_contacts(self.isolation.check)
        self.run(50.0, _WARM_UP / 50.0)


@contextlib.contextmanager
def rig(frames: int, *, is_ordinary: bool, scene: str | None = None) -> Iterator[Rig]:
    """Start node, sender and listener for a scene of so many frames."""
    text = scene_text(frames) if scene is None else scene
    with isolated() as isolation:
        if is_ordinary:
            path = Path(isolation.folder) / "ordinary.yaml"
            path.write_text(text)
            node = isolation.start("benchmarks.messages.baseline", str(path))
        else:
            node = isolation.start_node(text, max_update_rate=_LARGEST_RATE)
        sender = Sender(isolation, frames)
        listener = Listener(isolation.domain)
        try:
            result = Rig(isolation, node, sender, listener)
            result.warm_up()
            yield result
        finally:
            listener.close()


def highest_rate(one: Rig, seconds: float, start: float) -> tuple[Measured, Measured | None]:
    """Return the run at the highest sustained rate and the first that was not sustained.

    Rates double until one is not sustained, or fall until one is; then the gap is halved twice.
    """
    best, worst, rate = None, None, start
    while best is None or worst is None:
        measured = _try(one, rate, seconds)
        if measured.is_sustained:
            best = measured
            if rate >= _LARGEST_RATE:
                return best, None
        else:
            worst = measured
            if rate < 1.0:
                return measured, measured
        rate = min(rate * 2.0, _LARGEST_RATE) if worst is None else rate / 2.0
        if best is not None and worst is not None:
            break
    for _ in range(2):
        measured = _try(one, float(np.sqrt(best.rate * worst.rate)), seconds)
        if measured.is_sustained:
            best = measured
        else:
            worst = measured
    return best, worst


def _try(one: Rig, rate: float, seconds: float) -> Measured:
    """Run at a rate, twice where it is not sustained: other work on the machine passes by."""
    measured = one.run(rate, seconds)
    return measured if measured.is_sustained else one.run(rate, seconds)
