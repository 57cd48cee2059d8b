"""One function in a process of its own: ``python -m scene_graph_ros.warmup.task module:name``.

Prints the name of each kernel that was compiled. Ends when its standard input does: with whoever
started it.
"""

from __future__ import annotations

import gc
import importlib
import os
import sys
import threading

from scene_graph_ros.geometry.compile_progress import leave_it_to_others
from scene_graph_ros.geometry.compiled.cache import written_behind
from scene_graph_ros.geometry.compiled.readiness import Compilations

__all__ = ["COMPILED", "main"]

COMPILED = "compiled kernel: "
"""What the lines begin with; others are of somebody else."""

_ALLOCATIONS = 50_000
"""Between two collections of garbage. Nearly all that numba makes stays: with the interpreter's
700, collections take a tenth of the time of compiling."""


def _end_with_input() -> None:
    # Not a buffered read: the interpreter's end would wait for its lock.
    while os.read(sys.stdin.fileno(), 1):
        pass
    os._exit(1)


def main() -> None:
    """Run the command line: the function, and how nice to be to other processes."""
    module, name = sys.argv[1].split(":")
    os.nice(int(sys.argv[2]))
    threading.Thread(target=_end_with_input, daemon=True).start()
    leave_it_to_others()
    gc.freeze()
    gc.set_threshold(_ALLOCATIONS)
    Compilations(ended=lambda kernel: print(f"{COMPILED}{kernel}", flush=True))  # noqa: T201
    with written_behind():
        getattr(importlib.import_module(module), name)()


if __name__ == "__main__":
    main()
