"""From the start of the process to the first contact message."""

from __future__ import annotations

import os
from pathlib import Path
import sys
import time

from benchmarks.messages.demo_cell import SCENE
from benchmarks.messages.listener import Listener
from benchmarks.messages.processes import isolated, ROOT
from benchmarks.messages.scene import scene_text
from scene_graph_ros.geometry.compiled.cache import cache_root

__all__ = ["start"]

_TRIALS = 3


def start(is_quick: bool) -> None:
    """Print the time to the first contact message, kernels compiled before: cold, then warm."""
    scenes: dict[str, str | Path] = {
        "10 frames": scene_text(10),
        "1000 frames": scene_text(1000),
        "the demo's cell": SCENE,
    }
    print("seconds from the start of the process to the first contact message, kernels compiled;")
    print("cold: programs and kernels are not in the memory that files are cached in")
    for name, scene in list(scenes.items())[: 1 if is_quick else None]:
        cold = _first_contacts(scene) if _forget_files() else float("nan")
        warm = [_first_contacts(scene) for _ in range(1 if is_quick else _TRIALS)]
        figures = f"{min(warm):6.2f} best of {len(warm)}, {max(warm):6.2f} worst"
        print(f"{name:20} cold {cold:6.2f}, warm {figures}", flush=True)


def _first_contacts(scene: str | Path) -> float:
    with isolated() as isolation:
        listener = Listener(isolation.domain, with_markers=False)
        try:
            begin = time.monotonic()
            isolation.start_node(scene)
            listener.wait_for_contacts(isolation.check)
            return time.monotonic() - begin
        finally:
            listener.close()


def _forget_files() -> bool:
    """Have the files that programs and kernels are in read from the disk again, if they can be.

    Only those that are not in use leave the memory, and this process uses some of them.
    """
    if not hasattr(os, "posix_fadvise"):
        return False
    for folder in (Path(sys.prefix), cache_root(), ROOT / "scene_graph_ros"):
        for path in folder.rglob("*"):
            if path.is_file():
                with path.open("rb") as file:
                    os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    return True
