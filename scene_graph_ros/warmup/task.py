"""One function in a process of its own: ``python -m scene_graph_ros.warmup.task module:name``.

Prints how many kernels there may be to compile, then the name of each that was. Ends when its
standard input does: with whoever started it.
"""

from __future__ import annotations

import importlib
import os
import sys
import threading

from scene_graph_ros.geometry.compile_progress import leave_it_to_others
from scene_graph_ros.geometry.compiled.kernel import kernel_count
from scene_graph_ros.geometry.compiled.readiness import Compilations

__all__ = ["COMPILED", "COUNT", "main"]

COUNT, COMPILED = "kernels to compile: ", "compiled kernel: "
"""What the lines begin with; others are of somebody else."""


def _end_with_input() -> None:
    # Not a buffered read: the interpreter's end would wait for its lock.
    while os.read(sys.stdin.fileno(), 1):
        pass
    os._exit(1)


def _count(module: str) -> int:
    """Import a module; count the kernels that it has beyond those of the main job."""
    importlib.import_module("scene_graph_ros.warmup.main_job")
    before = kernel_count()
    importlib.import_module(module)
    return kernel_count() - before or before


def main() -> None:
    """Run the command line: the function, and how nice to be to other processes."""
    module, name = sys.argv[1].split(":")
    os.nice(int(sys.argv[2]))
    threading.Thread(target=_end_with_input, daemon=True).start()
    print(f"{COUNT}{_count(module)}", flush=True)  # noqa: T201
    leave_it_to_others()
    Compilations(ended=lambda kernel: print(f"{COMPILED}{kernel}", flush=True))  # noqa: T201
    getattr(importlib.import_module(module), name)()


if __name__ == "__main__":
    main()
