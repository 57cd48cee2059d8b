"""From poses to a page: how late a real browser has what moved.

    python -m benchmarks.browser [--bodies 50 1000] [--rate 30] [--seconds 10] [--without-drawing]

A node, a sender of poses and Chromium without a window, each a process of its own, on this
machine. Each pose message has the time at which it was sent as its stamp; the page's own messages
tell it again, and by the same clock the page notes when a message came, when it was taken in and
when the next picture was drawn. Needs Chromium: apt-get install chromium.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
import socket
import sys
import time
from typing import Any, NamedTuple

import numpy as np

from benchmarks.machine import machine
from benchmarks.messages.processes import cpu_seconds, isolated, ROOT, Sender
from benchmarks.messages.scene import scene_text

sys.path.insert(0, str(ROOT / "test" / "support"))
from chromium import find_chromium, REMEDY, Tab  # type: ignore[import-not-found]

__all__ = ["Delays", "free_port", "main", "measure", "open_page"]

_SETTLE = 2.0
"""Seconds of poses before those that count."""

_HOOK = """
window.delays = [];
const original = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
const now = () => performance.timeOrigin + performance.now();
Object.defineProperty(WebSocket.prototype, "onmessage", { set(take) {
  original.set.call(this, (event) => {
    const row = [1000 * new Float64Array(event.data, 8, 1)[0], now()];
    take(event);
    row.push(now());
    const done = () => { row.push(now()); window.delays.push(row); };
    if (window.isBlind) done(); else requestAnimationFrame(done);
  });
} });
"""
"""Run in the page before its own scripts: milliseconds of stamp, came, taken in, drawn."""

_BLIND = "window.isBlind = true; window.requestAnimationFrame = () => 0;"
"""Run before that where nothing is to be drawn: by software that takes all of a small machine."""


class Delays(NamedTuple):
    """What was measured of one number of bodies."""

    bodies: int
    sent: int
    """Pose messages."""
    ms: np.ndarray
    """(n, 3) from the stamp until the page's message came, was taken in, and was drawn."""
    node: float
    """Part of a core that the node used."""


def measure(bodies: int, rate: float, seconds: float, *, draws: bool = True) -> Delays:
    """Send poses of ``bodies`` at ``rate`` Hz, and return how late one page had them."""
    with isolated() as isolation:
        port = free_port()
        node = isolation.start_node(
            scene_text(bodies), browser=True, browser_port=port, browser_rate=2.0 * rate
        )
        sender = Sender(isolation, bodies)
        tab = Tab(800, 600)
        try:
            tab._ask(
                "Page.addScriptToEvaluateOnNewDocument", source=_HOOK if draws else _BLIND + _HOOK
            )
            open_page(tab, port, isolation)
            tab.wait_for(f"document.body?.dataset.items === '{bodies}'")
            sender.begin(rate, _SETTLE)
            sender.end()
            tab.value("window.delays.length = 0")
            before, begin = cpu_seconds(node.pid), time.monotonic()
            sender.begin(rate, seconds)
            sent = sender.end()
            used = (cpu_seconds(node.pid) - before) / (time.monotonic() - begin)
            time.sleep(0.5)
            rows = np.array(tab.value("window.delays"), dtype=float).reshape(-1, 4)
            assert tab.problems == [], tab.problems
        finally:
            tab.close()
        _, first = np.unique(rows[:, 0], return_index=True)
        rows = rows[first]
        return Delays(bodies, sent, rows[:, 1:] - rows[:, :1], used)


def open_page(tab: Any, port: int, isolation: Any) -> None:
    """Open a node's page in a tab when the node serves it."""
    end = time.monotonic() + 120.0
    while True:
        isolation.check()
        with socket.socket() as tried:
            if tried.connect_ex(("127.0.0.1", port)) == 0:
                break
        if time.monotonic() > end:
            raise RuntimeError("the node does not serve its page")
        time.sleep(0.1)
    tab.open(f"http://127.0.0.1:{port}/")


def free_port() -> int:
    """Return a port that nobody uses now."""
    with socket.create_server(("127.0.0.1", 0)) as found:
        return int(found.getsockname()[1])


def _line(found: Delays) -> str:
    figures = [
        f"{np.median(column):6.1f} {np.percentile(column, 90):6.1f} {column.max():7.1f}"
        for column in found.ms.T
    ]
    seen = f"{len(found.ms)} of {found.sent}"
    return f"{found.bodies:6} {seen:>12} | {' | '.join(figures)} | {100 * found.node:5.1f} %"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each number of bodies; return 0, 2 without Chromium."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.browser")
    parser.add_argument("--bodies", type=int, nargs="+", default=[50, 1000])
    parser.add_argument("--rate", type=float, default=30.0, help="Hz")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--without-drawing", action="store_true")
    options = parser.parse_args(arguments)
    if find_chromium() is None:
        print(REMEDY)
        return 2
    print(machine(os.getloadavg()[0]))
    print(
        f"{'milliseconds: median, 90 %, most':19} | until it came | until it was taken in | drawn"
    )
    for bodies in options.bodies:
        draws = not options.without_drawing
        print(_line(measure(bodies, options.rate, options.seconds, draws=draws)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
