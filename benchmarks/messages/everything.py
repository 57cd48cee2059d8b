"""Everything at once for long: page, recording, cameras, slow and storming clients.

    python -m benchmarks.messages.everything --seconds 3600 --write

A node with a view in a browser records itself and renders a camera, which some subscribe to; poses
of all frames come at a rate. The first part of the time is without clients of the page, for
comparison; then come those of ``benchmarks.messages.page_clients``. A row of the table is a piece
of the time: contacts a second, latency from the stamp of poses to the receipt of their contacts,
memory and share of a core of the node, and the machine's load, as what else it does makes messages
late, too. All on loopback.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import contextlib
import csv
import importlib
import os
from pathlib import Path
import socket
import time
from typing import NamedTuple

import numpy as np
import rclpy
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from tqdm import tqdm

from benchmarks.messages.listener import Listener
from benchmarks.messages.processes import (
    cpu_seconds,
    isolated,
    Isolation,
    resident_bytes,
    ROOT,
    Sender,
)
from benchmarks.messages.scene import scene_text, SOURCE

__all__ = ["Piece", "everything", "write_csv"]

_CAMERA = f"""cameras:
  - {{name: eye, source: {SOURCE}, size: [160, 120], pose: {{xyz: [0, 0, -2]}},
     clipping: [0.01, 100], intrinsics: {{fx: 160, fy: 160, cx: 80, cy: 60}},
     depth_range: [0.1, 100], images: [color]}}
"""
_ALONE = 0.2
"""Part of the time without clients of the page."""
_PIECES = 120
_CAMERA_READERS = 4
_MEGABYTE = 1e6


class Piece(NamedTuple):
    """What a piece of the time showed."""

    seconds: float
    """Since the beginning, at its end."""
    has_clients: bool
    contacts_per_second: float
    """Messages of contacts that poses of their own led to."""
    median_ms: float
    worst_of_100_ms: float
    """99 %."""
    worst_of_1000_ms: float
    """99.9 %."""
    memory_mb: float
    share_of_a_core: float
    load: float
    """Load average of the machine's last minute, at its end: processes that run or want to."""


def _piece(
    begin: float, span: float, latencies: np.ndarray, memory: int, cpu: float, *, busy: bool
) -> Piece:
    if len(latencies):
        some = np.percentile(latencies, (50.0, 99.0, 99.9)).tolist()
    else:
        some = [float("nan")] * 3
    rate = len(latencies) / span
    load = os.getloadavg()[0]
    return Piece(begin + span, busy, rate, *some, memory / _MEGABYTE, cpu / span, load)


class _CameraReaders:
    """Subscribers of the camera's image, in a node each."""

    def __init__(self, domain: int) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._nodes = [
            rclpy.create_node(f"looker_{k}", context=self._context) for k in range(_CAMERA_READERS)
        ]
        topic = "/scene_graph/cameras/eye/color/image"
        for node in self._nodes:
            # What nobody takes stays in the middleware, as with a subscriber that is busy.
            node.create_subscription(
                Image, topic, lambda data: None, QoSProfile(depth=1), raw=True
            )

    def close(self) -> None:
        """End them."""
        for node in self._nodes:
            node.destroy_node()
        rclpy.shutdown(context=self._context)


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])


def _watch(
    isolation: Isolation,
    node: int,
    listener: Listener,
    seconds: float,
    come: Callable[[], None],
    progress: Callable[[float], None],
) -> list[Piece]:
    """Collect pieces until the time is over; clients ``come`` after some of it."""
    pieces: list[Piece] = []
    seen: dict[int, int] = {}
    begin = last = time.monotonic()
    used, period, busy = cpu_seconds(node), max(seconds / _PIECES, 0.5), False
    listener.arrivals.clear()
    while last < begin + seconds:
        if not busy and last >= begin + _ALONE * seconds:
            busy = True
            come()
        time.sleep(period)
        isolation.check()
        arrivals, listener.arrivals = listener.arrivals, []
        latencies = []
        for stamp, arrival in arrivals:
            # Contacts are published again while nothing moves: the first of a stamp counts. Before
            # the first pose there is no stamp.
            if stamp and stamp not in seen:
                seen[stamp] = arrival
                latencies.append((arrival - stamp) * 1e-6)
        for stamp in list(seen)[:-1000]:
            del seen[stamp]
        now, cpu = time.monotonic(), cpu_seconds(node)
        span, memory = now - last, resident_bytes(node)
        told = np.array(latencies)
        pieces.append(_piece(last - begin, span, told, memory, cpu - used, busy=busy))
        last, used = now, cpu
        progress(now - begin)
    return pieces


def everything(
    seconds: float,
    *,
    frames: int = 200,
    rate: float = 100.0,
    progress: Callable[[float], None] = lambda done: None,
) -> list[Piece]:
    """Run all of it for a while; return what each piece of the time showed."""
    with contextlib.ExitStack() as held:
        isolation = held.enter_context(isolated())
        port = _free_port()
        node = isolation.start_node(
            scene_text(frames) + _CAMERA,
            browser=True,
            browser_port=port,
            record=isolation.folder / "recording",
            shutdown_timeout=20.0,
        )
        sender = Sender(isolation, frames)
        listener = Listener(isolation.domain)
        held.callback(listener.close)
        listener.wait_for_contacts(isolation.check)
        held.callback(_CameraReaders(isolation.domain).close)

        def come() -> None:
            address = f"http://127.0.0.1:{port}/"
            isolation.start("benchmarks.messages.page_clients", address)

        sender.begin(rate, seconds + 5.0)
        return _watch(isolation, node.pid, listener, seconds, come, progress)


def write_csv(pieces: list[Piece], path: Path) -> None:
    """Write a row for each piece."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(Piece._fields)
        for piece in pieces:
            writer.writerow(f"{float(value):.6g}" for value in piece)


def draw(pieces: list[Piece], path: Path) -> None:
    """Draw contacts a second, latency, memory and the machine's load over time."""
    importlib.import_module("matplotlib").use("Agg")
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, axes = pyplot.subplots(4, 1, figsize=(8.0, 8.5), sharex=True)
    rates, times, memory, load = axes
    minutes = [piece.seconds / 60.0 for piece in pieces]
    rates.plot(minutes, [piece.contacts_per_second for piece in pieces])
    rates.set_ylabel("contacts/s")
    rates.set_ylim(0.0, 1.1 * max(piece.contacts_per_second for piece in pieces))
    for field, name in (
        ("median_ms", "median"),
        ("worst_of_100_ms", "99 %"),
        ("worst_of_1000_ms", "99.9 %"),
    ):
        times.plot(minutes, [getattr(piece, field) for piece in pieces], label=name)
    times.set_yscale("log")
    times.set_ylabel("latency (ms)")
    times.legend()
    memory.plot(minutes, [piece.memory_mb for piece in pieces])
    memory.set_ylabel("memory (MB)")
    memory.set_ylim(0.0, 1.1 * max(piece.memory_mb for piece in pieces))
    load.plot(minutes, [piece.load for piece in pieces])
    load.axhline(os.cpu_count() or 1, color="grey", linewidth=0.8)
    load.set_ylabel("load (line: cores)")
    load.set_ylim(bottom=0.0)
    load.set_xlabel("minutes")
    came = next((piece.seconds / 60.0 for piece in pieces if piece.has_clients), None)
    for each in axes:
        if came is not None:
            each.axvline(came, color="grey", linestyle=":")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def summary(pieces: list[Piece]) -> str:
    """Return lines that compare the time without clients of the page with that with them."""
    lines = []
    for busy, name in ((False, "without clients of the page"), (True, "with them")):
        rows = np.array([piece for piece in pieces if piece.has_clients == busy])
        if len(rows):
            _, _, rate, median, late, latest, memory, share, load = np.nanmedian(rows, axis=0)
            lines.append(
                f"{name}: {rate:.1f} contacts/s, {median:.2f} ms median, {late:.1f} ms 99 %, "
                f"{latest:.1f} ms 99.9 %, {memory:.0f} MB, {share:.2f} of a core, load {load:.1f}"
            )
    return "\n".join([*lines, f"most memory {max(piece.memory_mb for piece in pieces):.0f} MB"])


def main() -> None:
    """Run it and print; with --write, write the table and the picture of docs/messages.md."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.messages.everything",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument(
        "--write", action="store_true", help="write docs/soak.csv and docs/soak.png"
    )
    options = parser.parse_args()
    with tqdm(total=options.seconds, unit="s", bar_format="{l_bar}{bar}| {n:.0f} s") as bar:
        pieces = everything(
            options.seconds,
            frames=options.frames,
            rate=options.rate,
            progress=lambda now: bar.update(now - bar.n),
        )
    print(summary(pieces))
    if options.write:
        write_csv(pieces, ROOT / "docs" / "soak.csv")
        draw(pieces, ROOT / "docs" / "soak.png")


if __name__ == "__main__":
    main()
