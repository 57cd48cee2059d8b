"""How long answers of services take while the world is updated at full rate."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import subprocess
import time
from typing import Any

import numpy as np
from tqdm import tqdm

from benchmarks.messages.demo_cell import demo_cell
from benchmarks.messages.empty_service import EMPTY
from benchmarks.messages.processes import Isolation
from benchmarks.messages.report import Answers
from benchmarks.messages.sustained import rig

__all__ = ["Asker", "services"]

_RATE = 200.0
_WARM_UP = 0.5
_STOP = 600.0
"""Seconds that a sender is told to send: longer than any run, it is ended before."""


class Asker:
    """A process that asks services, and one whose service is empty.

    See ``benchmarks.messages.asker`` and ``benchmarks.messages.empty_service``.
    """

    def __init__(self, isolation: Isolation, pair: tuple[str, str], frame: str) -> None:
        self._isolation = isolation
        isolation.start("benchmarks.messages.empty_service")
        self.process = isolation.start(
            "benchmarks.messages.asker",
            *("--pair", *pair, "--frame", frame),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ask(self, seconds: float) -> dict[str, list[float]]:
        """Return the milliseconds of each answer, by service."""
        self._isolation.ask(self.process, seconds=seconds)
        return self._isolation.answer(self.process)


@contextlib.contextmanager
def _frames(count: int) -> Iterator[tuple[Asker, Any]]:
    """Run so many frames at full rate, contacts and markers listened to."""
    with rig(count, is_ordinary=False) as one:
        one.sender.begin(_RATE, _STOP)
        yield Asker(one.isolation, ("g1", "g2"), "object_3"), one.listener


@contextlib.contextmanager
def _panda() -> Iterator[tuple[Asker, Any]]:
    """Run the demo's cell, contacts and markers listened to."""
    with demo_cell(rate=_RATE) as (isolation, _, listener):
        yield Asker(isolation, ("ball", "can"), "can"), listener


def services(is_quick: bool) -> list[Answers]:
    """Print the times from a request to its answer, at the client."""
    seconds = 2.0 if is_quick else 20.0
    print(f"milliseconds from request to answer while poses come at {_RATE:g} Hz")
    head = f"{'load':12} {'service':33} {'answers':>7} {'median':>7} {'99 %':>7} {'worst':>7}"
    print(head + " updates/s")
    loads = {"the demo": _panda, "100 frames": lambda: _frames(100)}
    if not is_quick:
        loads["1000 frames"] = lambda: _frames(1000)
    rows = []
    for name, load in tqdm(loads.items(), desc="services", leave=False):
        with load() as (asker, listener):
            asker.ask(_WARM_UP)
            before, begin = len(listener.arrivals), time.monotonic()
            times = asker.ask(seconds)
            rate = (len(listener.arrivals) - before) / (time.monotonic() - begin)
        empty = times.pop(EMPTY)
        times["all"] = [value for each in times.values() for value in each]
        times[EMPTY] = empty
        for service, values in times.items():
            rows.append(Answers(name, service, np.array(values), rate))
            median, high = np.percentile(values, (50, 99))
            figures = f"{len(values):7} {median:7.2f} {high:7.2f} {max(values):7.2f}"
            print(f"{name:12} {service:33} {figures} {rate:9.0f}", flush=True)
    return rows
