"""Says on stderr that kernels are compiled, and how many so far, where somebody waits for them."""

from __future__ import annotations

import os
import sys
import threading
import time
import warnings

from scene_graph_ros.geometry.compiled.cache import cache_problem
from scene_graph_ros.geometry.compiled.readiness import Compilations, KernelCompilationWarning

__all__ = ["SILENCE", "CompileProgress", "leave_it_to_others", "show_compilation"]

SILENCE = "SCENE_GRAPH_ROS_COMPILE_PROGRESS"
"""The variable of the environment that says ``off`` where nothing is to be said."""
_FIRST = 1.0
"""Seconds of compiling after which there is a line; the next ones come at ten times that, then
each time after twice as long."""
_SECOND = 10.0

_MEANING = (
    "has to be compiled first, and others may have to be: that takes up to minutes, once. "
    "`python -m scene_graph_ros.warmup` compiles what the main job needs beforehand, with --all "
    "what contact surfaces and other capabilities need, too"
)


class CompileProgress:
    """Counts the kernels that a process compiles, and tells of them from a second on."""

    def __init__(self) -> None:
        """Begin with nothing compiled."""
        self._lock = threading.Lock()
        self._count = self._running = 0
        self._began: float | None = None
        self._next = _FIRST
        self._is_warned = False
        self.is_left_to_others = False
        """Whether somebody else says it in a way of its own."""

    def began(self, kernel: str) -> None:
        """Note that a kernel is compiled."""
        with self._lock:
            self._running += 1
            is_first, self._is_warned = not self._is_warned, True
            if self._began is None:
                self._began = time.monotonic()
                timer = threading.Timer(_FIRST, self._tell)
                timer.daemon = True
                timer.start()
        # Of a bad cache there is a warning.
        if is_first and not self.is_left_to_others and not cache_problem():
            warnings.warn(f"kernel {kernel} {_MEANING}", KernelCompilationWarning, stacklevel=2)

    def ended(self, kernel: str) -> None:
        """Note that it is done."""
        with self._lock:
            self._running -= 1
            self._count += 1
        self._tell()

    def _tell(self) -> None:
        """Print the progress, where it is time for that."""
        with self._lock:
            if self._began is None or self.is_left_to_others:
                return
            seconds = time.monotonic() - self._began
            if seconds < self._next or not (self._running or self._count):
                return
            self._next = max(2.0 * self._next, _SECOND)
            while self._next <= seconds:
                self._next *= 2.0
            count = self._count
        if os.environ.get(SILENCE, "").lower() in ("off", "0", "false"):
            return
        kernels = "kernel" if count == 1 else "kernels"
        text = f"scene_graph_ros: compiling, {count} {kernels} in {seconds:.0f} s"
        print(f"{text} ({SILENCE}=off is silent)", file=sys.stderr, flush=True)  # noqa: T201


_progress = CompileProgress()
_watch: list[Compilations] = []


def show_compilation() -> None:
    """Tell of kernels that this process compiles, from now on."""
    if not _watch:
        _watch.append(Compilations(_progress.began, _progress.ended))


def leave_it_to_others(is_left: bool = True) -> None:
    """Say nothing while somebody else does, such as a node in its log."""
    _progress.is_left_to_others = is_left
