"""The demo's cell: a Panda by joint positions and objects by poses, over DDS."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
from pathlib import Path
import subprocess
import time
from typing import Any

import numpy as np
from tqdm import tqdm
import yaml

from benchmarks.messages.listener import Listener
from benchmarks.messages.processes import cpu_seconds, isolated, Isolation, ROOT
from benchmarks.messages.report import Cell, cells_table

__all__ = ["SCENE", "demo_cell", "panda"]

SCENE = ROOT / "config" / "scenes" / "panda_cell.yaml"
CROWD = 50
"""Objects in the cell with a crowd."""

_RATE = 100.0
_PHASES = {"half a period": 0.5 / _RATE, "1 ms": 1e-3, "0.5 ms": 5e-4, "nothing": 0.0}
"""By how much the objects' messages are sent after the Panda's, in seconds."""

_SETTLE = 3.0
"""Seconds in which everything is used once."""


def _crowded_scene() -> str:
    """Return the text of the demo's scene with so many more objects that they are a crowd."""
    scene = yaml.safe_load(SCENE.read_text())
    for geometry in scene["geometries"]:
        if "file" in geometry["shape"]:
            geometry["shape"]["file"] = str(SCENE.parent / geometry["shape"]["file"])
    shapes = [
        {"type": "sphere", "radius": 0.03},
        {"type": "box", "size": [0.05, 0.06, 0.07]},
        {"type": "cylinder", "radius": 0.02, "length": 0.08},
        {"type": "ellipsoid", "semi_axes": [0.04, 0.03, 0.02]},
    ]
    for k in range(CROWD - len(scene["frames"])):
        name, place = f"more_{k}", [0.3 + 0.08 * (k % 7), -0.4 + 0.16 * (k // 7), 0.55]
        scene["frames"].append({"name": name, "source": "objects", "pose": {"xyz": place}})
        body = {"name": name, "source": "objects", "frame": name, "shape": shapes[k % len(shapes)]}
        scene["geometries"].append(body)
    return yaml.safe_dump(scene)


@contextlib.contextmanager
def demo_cell(
    scene: str | Path = SCENE, *, rate: float, phase: float | None = None
) -> Iterator[tuple[Isolation, subprocess.Popen[Any], Listener]]:
    """Start the node with a scene, a Panda, moving objects and a listener; wait for all.

    ``phase`` is how many seconds after the Panda's the objects' messages are sent; None: as it
    happens.
    """
    with isolated() as isolation:
        node = isolation.start_node(scene)
        for name, offset in (("panda_robot", 0.0), ("moving_objects", phase)):
            timing = ["--rate", str(rate)]
            if phase is not None:
                timing += ["--phase", str(offset)]
            isolation.start_script(ROOT / "examples" / f"{name}.py", *timing)
        listener = Listener(isolation.domain, with_markers=True)
        try:
            listener.wait_for_contacts(isolation.check)
            while listener.arrivals[-1][0] == 0:
                time.sleep(0.01)
            time.sleep(_SETTLE)
            isolation.check()
            yield isolation, node, listener
        finally:
            listener.close()


def panda(is_quick: bool) -> list[Cell]:
    """Print the latency of the demo, and of the same with fifty objects."""
    seconds = 3.0 if is_quick else 15.0
    cells = {"the demo": SCENE, f"with {CROWD} objects": _crowded_scene()}
    rows = [
        _measure(name, scene, apart, seconds)
        for name, scene in cells.items()
        for apart in tqdm(_PHASES, desc=name, leave=False)
    ]
    print("from the stamp of a pose message to the receipt of its contacts")
    print(cells_table(rows))
    return rows


def _measure(name: str, scene: str | Path, apart: str, seconds: float) -> Cell:
    """Measure the latency of a cell whose two sources send so far apart."""
    with demo_cell(scene, rate=_RATE, phase=_PHASES[apart]) as (_, node, listener):
        listener.arrivals.clear()
        used, begin = cpu_seconds(node.pid), time.monotonic()
        time.sleep(seconds)
        elapsed = time.monotonic() - begin
        share = (cpu_seconds(node.pid) - used) / elapsed
        first: dict[int, int] = {}
        for stamp, arrival in list(listener.arrivals):
            first.setdefault(stamp, arrival)
    latencies = np.array([arrival - stamp for stamp, arrival in first.items()]) * 1e-6
    return Cell(name, apart, latencies, len(latencies) / elapsed, share)
