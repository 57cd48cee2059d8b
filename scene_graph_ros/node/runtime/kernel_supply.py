"""Kernels beside those of the main job, compiled when something first asks for them.

That takes half a minute or more, so it is done in a process of its own, beside everything else.
Where kernels can't be kept, or that process fails, a call of one compiles it in this process.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import queue
import threading
import time
from typing import Any

from scene_graph_ros.geometry.compiled.cache import cache_problem
from scene_graph_ros.geometry.compiled.readiness import is_ready
from scene_graph_ros.warmup.compiler import Compiler, CompilingError, Progress
from scene_graph_ros.warmup.groups import GROUPS, KernelGroup

__all__ = ["KernelSupply"]

_NICENESS = 5
"""The node's contacts come first: where all cores are busy, compiling gets a third of the share of
others. With 10 it would get a ninth, and hardly end on a machine that is always busy."""

_TELL_PERIOD = 5.0
"""Seconds between two log entries about progress."""


class KernelSupply:
    """Has groups of kernels compiled one after the other, each when it is first asked for."""

    def __init__(
        self,
        logger: Any,
        came: Callable[[], None],
        groups: Mapping[str, KernelGroup] = GROUPS,
    ) -> None:
        """Call ``came`` in a thread of its own whenever a group has become ready."""
        self._logger, self._came, self._groups = logger, came, groups
        self._lock = threading.Lock()
        self._wanted: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._compiler: Compiler | None = None
        self._is_stopped = False
        self._ready: set[str] = set()
        self._progress: dict[str, Progress | None] = {}

    def lack(self, group: str) -> str:
        """Return a sentence about a group's kernels that are not ready; "" where they are.

        "" is the group of the main kernels. The first call has the group compiled.
        """
        if not group or group in self._ready:
            return ""
        with self._lock:
            if group in self._progress:
                return self._sentence(group)
            if is_ready(group) or cache_problem():
                # Of a bad cache `KernelWatch` has told already.
                self._ready.add(group)
                return ""
            if self._is_stopped:
                return f"the kernels of {self._groups[group].what} are not compiled"
            self._progress[group] = None
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="kernels", daemon=True)
                self._thread.start()
            self._wanted.put(group)
            return self._sentence(group)

    def stop(self) -> None:
        """Compile no more."""
        with self._lock:
            self._is_stopped = True
            self._wanted.put(None)
            if self._compiler is not None:
                self._compiler.stop()

    def _sentence(self, group: str) -> str:
        progress, what = self._progress.get(group), f"the kernels of {self._groups[group].what}"
        if progress is None:
            return f"{what} are about to be compiled"
        return f"{what} are being compiled: {progress.done} of {progress.total}"

    def _run(self) -> None:
        while (group := self._wanted.get()) is not None:
            with self._lock:
                if self._is_stopped:
                    return
                self._compiler = Compiler([self._groups[group]], niceness=_NICENESS)
            self._compile(group, self._compiler)

    def _compile(self, group: str, compiler: Compiler) -> None:
        what, begin = self._groups[group].what, time.monotonic()
        self._logger.info(
            f"{what}: asked for, but their kernels have to be compiled first, once; that takes "
            "half a minute or more, beside everything else"
        )
        told_at = begin

        def tell(progress: Progress) -> None:
            nonlocal told_at
            self._progress[group] = progress
            if time.monotonic() - told_at >= _TELL_PERIOD:
                told_at = time.monotonic()
                self._logger.info(self._sentence(group))

        try:
            compiler.run(tell)
        except (CompilingError, OSError) as error:
            if self._is_stopped:
                return
            self._logger.warning(
                f"{what}: their kernels are compiled within the node, which holds others up, as "
                f"it can't be done beside it: {error}"
            )
        else:
            seconds = time.monotonic() - begin
            self._logger.info(f"{what}: their kernels are compiled, after {seconds:.0f} s")
        with self._lock:
            self._ready.add(group)
            del self._progress[group]
        self._came()
