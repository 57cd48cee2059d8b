"""Functions in a process of their own: ``python -m scene_graph_ros.warmup.task NICENESS``.

Reads their names, ``module:name``, from its standard input, a line each, and calls one after the
other: what numba and the package take to import is spent once. Prints the name of each kernel that
was compiled, and `ENDED` after each function. Ends when its standard input does: with the process
that started it.
"""

from __future__ import annotations

import gc
import importlib
import os
import queue
import sys
import threading

from scene_graph_ros.geometry.compile_progress import leave_it_to_others
from scene_graph_ros.geometry.compiled.cache import written_behind
from scene_graph_ros.geometry.compiled.readiness import Compilations

__all__ = ["COMPILED", "ENDED", "main"]

COMPILED = "compiled kernel: "
"""What the lines begin with; others are of somebody else."""

ENDED = "task ended"
"""The line after all kernels of a function are kept."""

_ALLOCATIONS = 50_000
"""Between two collections of garbage. Nearly all that numba makes stays: with the interpreter's
700, collections take a tenth of the time of compiling."""


def _read_names(names: queue.SimpleQueue[str]) -> None:
    # Not a buffered read: the interpreter's end would wait for its lock.
    begun = b""
    while read := os.read(sys.stdin.fileno(), 4096):
        *lines, begun = (begun + read).split(b"\n")
        for line in lines:
            names.put(line.decode())
    os._exit(1)


def main() -> None:
    """Run the command line: how nice to be to other processes."""
    os.nice(int(sys.argv[1]))
    names: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_read_names, args=(names,), daemon=True).start()
    leave_it_to_others()
    gc.freeze()
    gc.set_threshold(_ALLOCATIONS)
    Compilations(ended=lambda kernel: print(f"{COMPILED}{kernel}", flush=True))  # noqa: T201
    while True:
        module, name = names.get().split(":")
        with written_behind():
            getattr(importlib.import_module(module), name)()
        print(ENDED, flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
