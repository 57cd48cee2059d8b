"""The /diagnostics messages: rates and ages per source, latency, drops, and each effect's time."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping
import sys
import threading
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np

from msg_adapters.diagnostics import (
    diagnostic_array_to_msg,
    diagnostic_status_to_msg,
    effect_to_diagnostic,
    effect_to_msg,
)
from scene_graph_ros.node.diagnostics_of_parts import Parts
from scene_graph_ros.node.effects.state import EffectReport
from scene_graph_ros.node.world.faults import (
    CONFIGURATION_FAULTS,
    Fault,
    HEIGHT_FAULTS,
    IMAGE_FAULTS,
    INFO_FAULTS,
    POINT_FAULTS,
    POSE_FAULTS,
    VOXEL_FAULTS,
)
from scene_graph_ros.node.world.intake import Statistics
from scene_graph_ros.node.world.source_topics import CAMERA_INFO, DEPTH_IMAGES, HEIGHTS, VOXELS
from scene_graph_ros.views.moment import Trouble

__all__ = ["Diagnostics", "Monitor", "troubles_of"]

_OPTIONAL_MODULES = ("control_msgs", "meshio", "pytetwild", "tf2_msgs", "trimesh")
"""Costly or optional imports: reported, so that it can be seen what a scene really needs."""

_FAULTS_OF = {
    "configurations": CONFIGURATION_FAULTS,
    "points": POINT_FAULTS,
    DEPTH_IMAGES: IMAGE_FAULTS,
    CAMERA_INFO: INFO_FAULTS,
    HEIGHTS: HEIGHT_FAULTS,
    VOXELS: VOXEL_FAULTS,
}
"""The faults of what is not poses."""

_LATENCIES = 1000
"""Updates that the latency is taken over."""


class Monitor:
    """Counts updates and measures the time from a pose's arrival to its contact message."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._latencies: deque[float] = deque(maxlen=_LATENCIES)
        self._ticks: deque[int] = deque(maxlen=_LATENCIES)
        self._sequence = -1
        self.updates = 0
        self.clock_jumps = 0
        self.errors = 0

    def updated(self, now: int) -> None:
        """Count an update at steady time ``now``, nanoseconds."""
        with self._lock:
            self.updates += 1
            self._ticks.append(now)

    def published(self, sequence: int, arrival: int, now: int) -> None:
        """Record that poses which arrived at ``arrival`` went out as contacts at ``now`` (ns).

        The first contacts of each ``sequence`` count, the number of the poses' snapshot.
        """
        with self._lock:
            if sequence != self._sequence:
                self._sequence = sequence
                self._latencies.append((now - arrival) * 1e-9)

    def rate(self, now: int) -> float:
        """Return updates per second over the last two seconds."""
        with self._lock:
            recent = sum(tick >= now - 2_000_000_000 for tick in self._ticks)
        return recent / 2.0

    def latency(self) -> tuple[float, float, float]:
        """Return median, 99th percentile and worst of recent latencies in seconds; nan if none."""
        with self._lock:
            values = np.array(self._latencies)
        if values.size == 0:
            return (float("nan"),) * 3
        median, high = np.percentile(values, (50.0, 99.0)).tolist()
        return median, high, float(values.max())


class Diagnostics:
    """Builds the diagnostics message; remembers the last one, and so tells new faults apart."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._faults: dict[str, int] = {}

    def message(
        self,
        *,
        stamp: int,
        world: DiagnosticStatus,
        sources: Iterable[DiagnosticStatus],
        effects: Iterable[EffectReport],
    ) -> DiagnosticArray:
        """Return the whole message; ``stamp`` in nanoseconds."""
        statuses = [world, *sources]
        statuses += [self._effect(report) for report in effects]
        return diagnostic_array_to_msg(statuses, stamp_ns=stamp)

    def world(
        self,
        monitor: Monitor,
        now: int,
        *,
        scene_version: int,
        values: Mapping[str, Any],
        warning: str = "",
    ) -> DiagnosticStatus:
        """Return the entry of the world; ``now`` is steady time in nanoseconds."""
        median, high, worst = monitor.latency()
        entries = {
            "scene version": scene_version,
            "updates": monitor.updates,
            "update rate (Hz)": monitor.rate(now),
            "latency median (s)": median,
            "latency 99th percentile (s)": high,
            "latency worst (s)": worst,
            "clock jumps": monitor.clock_jumps,
            "internal errors": monitor.errors,
            "imported": " ".join(m for m in _OPTIONAL_MODULES if m in sys.modules),
            **values,
        }
        level, text = DiagnosticStatus.OK, "updating"
        if warning:
            level, text = DiagnosticStatus.WARN, warning
        if monitor.errors:
            level, text = DiagnosticStatus.ERROR, "internal errors: see the log"
        return diagnostic_status_to_msg(f"{self._name}: world", level, text, entries)

    def source(
        self,
        source: str,
        topic: str,
        statistics: Statistics,
        now: int,
        max_age: float,
        *,
        noun: str = "poses",
        parts: Parts | None = None,
    ) -> DiagnosticStatus:
        """Return the entry of a source's topic; ``now`` is steady time, ``max_age`` seconds.

        ``noun`` is the content of the topic, such as "poses" or "configurations"; ``parts`` are
        the entries of the source's parts.
        """
        parts = Parts({}) if parts is None else parts
        name = source if noun == "poses" else f"{source} {noun}"
        age = None if statistics.last_arrival is None else (now - statistics.last_arrival) * 1e-9
        faults: Counter[Fault] = statistics.faults.copy()
        values: dict[str, Any] = {
            "topic": topic,
            "rate (Hz)": statistics.rate(now),
            "age (s)": "never" if age is None else age,
            "messages received": statistics.received,
            "messages superseded": statistics.superseded,
            f"{noun} applied": statistics.applied_poses,
            "dropped": sum(faults.values()),
        }
        listed = _FAULTS_OF.get(noun, POSE_FAULTS)
        values.update({fault.value: faults[fault] for fault in listed})
        values.update(parts.values)
        total = sum(faults.values())
        new, self._faults[name] = total - self._faults.get(name, 0), total
        level, text = DiagnosticStatus.OK, f"receiving {noun}"
        if age is None:
            text = f"no {noun} yet"
        elif parts.stale:
            level, text = DiagnosticStatus.STALE, parts.stale
        elif not statistics.is_static and 0.0 < max_age < age:
            level, text = DiagnosticStatus.STALE, f"no {noun} for {age:.1f} s"
        if parts.warning:
            level, text = DiagnosticStatus.WARN, parts.warning
        if new > 0:
            level, text = DiagnosticStatus.WARN, f"{new} new faults: {_listed(faults)}"
        return diagnostic_status_to_msg(f"{self._name}: source {name}", level, text, values)

    def missing(self, source: str, reason: str, *, noun: str = "poses") -> DiagnosticStatus:
        """Return the entry of a source whose topic can't be subscribed to."""
        name = source if noun == "poses" else f"{source} {noun}"
        text = f"no {noun} can be received: {reason}"
        return diagnostic_status_to_msg(
            f"{self._name}: source {name}", DiagnosticStatus.ERROR, text, {}
        )

    def _effect(self, report: EffectReport) -> DiagnosticStatus:
        status = effect_to_diagnostic(effect_to_msg(report), f"{self._name}: effect")
        values = {**report.counters, "failures": report.failures}
        extra = diagnostic_status_to_msg("", DiagnosticStatus.OK, "", values)
        status.values = [*status.values, *extra.values]
        if report.stale:
            status.level, status.message = DiagnosticStatus.STALE, report.stale
        if report.warning:
            status.level, status.message = DiagnosticStatus.WARN, report.warning
        if report.failure:
            status.level, status.message = DiagnosticStatus.ERROR, f"failed: {report.failure}"
        return status


_LEVELS = {
    DiagnosticStatus.WARN: "warning",
    DiagnosticStatus.ERROR: "error",
    DiagnosticStatus.STALE: "stale",
}


def troubles_of(message: DiagnosticArray) -> tuple[Trouble, ...]:
    """Return the entries that warn or worse, without the node's own name."""
    return tuple(
        Trouble(_LEVELS[status.level], status.name.partition(": ")[2], status.message)
        for status in message.status
        if status.level in _LEVELS
    )


def _listed(faults: Mapping[Fault, int]) -> str:
    return ", ".join(f"{count} {fault.value}" for fault, count in faults.items() if count)
