"""From the start of the process to the first contact message."""

from __future__ import annotations

from pathlib import Path
import time

from benchmarks.messages.demo_cell import SCENE
from benchmarks.messages.listener import Listener
from benchmarks.messages.processes import isolated
from benchmarks.messages.scene import scene_text

__all__ = ["start"]

_TRIALS = 3


def start(is_quick: bool) -> None:
    """Print the time to the first contact message, kernels compiled before."""
    scenes: dict[str, str | Path] = {
        "10 frames": scene_text(10),
        "1000 frames": scene_text(1000),
        "the demo's cell": SCENE,
    }
    print("seconds from the start of the process to the first contact message, kernels compiled")
    for name, scene in list(scenes.items())[: 1 if is_quick else None]:
        times = []
        for _ in range(1 if is_quick else _TRIALS):
            with isolated() as isolation:
                listener = Listener(isolation.domain, with_markers=False)
                try:
                    begin = time.monotonic()
                    isolation.start_node(scene)
                    listener.wait_for_contacts(isolation.check)
                    times.append(time.monotonic() - begin)
                finally:
                    listener.close()
        print(f"{name:20} {min(times):6.2f} best of {len(times)}, {max(times):6.2f} worst")
