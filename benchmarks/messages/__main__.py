"""Path and latency of messages: rates, delays and single jobs, beside rclpy's ordinary way.

    python -m benchmarks.messages [--quick]
        [jobs | rates | latency | panda | services | edits | start | holes | images
         | planning]
    python -m benchmarks.messages rates --write       # docs/messages.md and its plot; 6 minutes
    python -m benchmarks.messages panda --write       # its table of the demo; 4 minutes
    python -m benchmarks.messages services --write    # its table of answers; 2 minutes
    python -m benchmarks.messages edits --write       # its table of changes; 3 minutes
    python -m benchmarks.messages holes --write       # its table of transports; an hour

Node, sender and listener are processes of their own that talk over DDS on this machine. The
ordinary way is in ``benchmarks/messages/baseline.py``; it asks the same core for the contacts.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
from typing import Any, cast

from tqdm import tqdm

from benchmarks.messages import micro
from benchmarks.messages.demo_cell import panda
from benchmarks.messages.edits import edits
from benchmarks.messages.holes import holes
from benchmarks.messages.images import images
from benchmarks.messages.planning import planning
from benchmarks.messages.report import (
    Row,
    write,
    write_answers,
    write_cells,
    write_edits,
    write_holes,
)
from benchmarks.messages.requests import services
from benchmarks.messages.start import start
from benchmarks.messages.sustained import highest_rate, Measured, rig

FRAMES = (10, 100, 1000)
WAYS = (("ordinary", True), ("ours", False))
_FIXED_RATE = 200.0
_FIRST_RATES = {10: (400.0, 1600.0), 100: (100.0, 800.0), 1000: (12.5, 200.0)}
"""Hz to begin with, ordinary and ours, by number of frames: near enough for a short search."""


def jobs(is_quick: bool) -> None:
    """Print what single jobs cost."""
    count, repetitions = (100, 30) if is_quick else (1000, 200)
    print(f"{'median processor time':38} {'ordinary':>10} {'ours':>10} {'ratio':>7}  result")
    for job in tqdm((micro.markers, micro.received_poses), desc="jobs", leave=False):
        what, ordinary, ours, size = job(count, repetitions)
        figures = f"{ordinary * 1e3:7.2f} ms {ours * 1e3:7.3f} ms {ordinary / ours:7.0f}"
        print(f"{what:38} {figures}  {size}")


def _row(frames: int, way: str, measured: Measured, rate: str) -> str:
    return (
        f"{frames:6} {way:9} {rate:>12} {measured.latency()} {measured.share:7.2f}"
        f" {measured.contacts:9} {measured.markers / measured.seconds:9.0f}"
    )


_HEAD = (
    f"{'frames':>6} {'way':9} {'poses/s':>12} {'median':>7} {'99 %':>8} {'worst':>8}"
    f" {'core':>7} {'contacts':>9} {'markers/s':>9}"
)


def rates(is_quick: bool) -> list[Row]:
    """Print the highest sustained rates, and latencies at a rate that is the same for all."""
    seconds = 1.0 if is_quick else 3.0
    print("highest rate at which 95 % of the poses have contacts of their own; latency in ms then")
    print(_HEAD)
    rows = []
    for frames in FRAMES[:1] if is_quick else FRAMES:
        for way, is_ordinary in tqdm(WAYS, desc=f"{frames} frames", leave=False):
            with rig(frames, is_ordinary=is_ordinary) as one:
                best, _ = highest_rate(one, seconds, _FIRST_RATES[frames][not is_ordinary])
                fixed = one.run(_FIXED_RATE, 3.0 * seconds)
            rows.append(Row(frames, way, best, fixed))
            print(_row(frames, way, best, f"{best.rate:.0f}"), flush=True)
    print(f"\nat {_FIXED_RATE:g} Hz: messages with contacts of their own of those sent")
    print(_HEAD)
    for frames, way, _, fixed in rows:
        print(_row(frames, way, fixed, f"{fixed.answered}/{fixed.sent}"), flush=True)
    return rows


def latency(is_quick: bool) -> None:
    """Print latencies at fixed rates, the same for both ways."""
    seconds = 2.0 if is_quick else 15.0
    print("milliseconds from the sending of poses to the receipt of their contacts")
    print(_HEAD)
    for frames in FRAMES[:1] if is_quick else FRAMES:
        for rate in (100.0, 200.0):
            for way, is_ordinary in tqdm(WAYS, desc=f"{frames} frames", leave=False):
                with rig(frames, is_ordinary=is_ordinary) as one:
                    measured = one.run(rate, seconds)
                sustained = f"{measured.answered}/{measured.sent}"
                print(_row(frames, way, measured, sustained), flush=True)


PARTS: dict[str, Callable[[bool], object]] = {
    "jobs": jobs,
    "rates": rates,
    "latency": latency,
    "panda": panda,
    "services": services,
    "edits": edits,
    "start": start,
    "holes": holes,
    "images": images,
    "planning": planning,
}

LONG = ("holes",)
"""What has to be asked for: it takes an hour."""

WRITTEN: dict[str, Callable[[list[Any], float], None]] = {
    "rates": write,
    "panda": write_cells,
    "services": write_answers,
    "edits": write_edits,
    "holes": write_holes,
}
"""What the page has tables of."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.messages",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("parts", nargs="*", help=f"of {', '.join(PARTS)}; without: all but holes")
    parser.add_argument("--quick", action="store_true", help="small and short, to try it out")
    parser.add_argument("--write", action="store_true", help="write the table to docs/messages.md")
    options = parser.parse_args()
    if options.write and (len(options.parts) != 1 or options.parts[0] not in WRITTEN):
        parser.error(f"--write goes with one of {', '.join(WRITTEN)}")
    unknown = set(options.parts) - set(PARTS)
    if unknown:
        parser.error(f"no such part: {', '.join(sorted(unknown))}")
    for name in options.parts or [part for part in PARTS if part not in LONG]:
        load = os.getloadavg()[0]
        print(f"\n== {name} ({os.cpu_count()} cores; {load:.1f} processes wanted them before)")
        result = PARTS[name](options.quick)
        if options.write:
            WRITTEN[name](cast("list[Any]", result), load)


if __name__ == "__main__":
    main()
