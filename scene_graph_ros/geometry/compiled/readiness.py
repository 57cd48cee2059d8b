"""Whether kernels have to be compiled first, and when one is.

Not imported by kernels, whose cache depends on all that they import.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core import event
import numba.core.config as numba_config

from scene_graph_ros.geometry.compiled.cache import (
    cache_problem,
    cache_root,
    digest_of_everything,
    KernelCache,
    packed_groups,
)

__all__ = [
    "Compilations",
    "KernelCompilationWarning",
    "is_ready",
    "ready_marker",
    "why_not_ready",
]


class KernelCompilationWarning(UserWarning):
    """A kernel has to be compiled before there is an answer, which takes seconds to minutes."""


def ready_marker(group: str) -> Path:
    """Return the file that is there once a group's kernels of these sources are compiled."""
    return cache_root() / f"ready-{group}-{digest_of_everything()}"


def is_ready(group: str) -> bool:
    """Tell whether a process will find the kernels of a group in the cache, or installed."""
    return bool(numba_config.DISABLE_JIT) or _is_packed(group) or ready_marker(group).exists()


def _is_packed(group: str) -> bool:
    """Tell whether the installation brings along the kernels of these sources."""
    packed = packed_groups().get(group)
    return packed is not None and packed == digest_of_everything()


def why_not_ready(group: str) -> str:
    """Say why this process will have to compile a group's kernels, "" where it finds them all."""
    if numba_config.DISABLE_JIT or _is_packed(group):
        return ""
    problem = cache_problem()
    if problem or is_ready(group):
        return problem
    return (
        f"the {group} kernels of this version have not all been compiled into {cache_root()} yet"
    )


def _ignore(kernel: str) -> None:
    """Listen to nothing."""


_watches: list[Compilations] = []


class Compilations(event.Listener):
    """Calls ``began`` and ``ended`` with the name of each kernel that this process compiles."""

    def __init__(
        self,
        began: Callable[[str], None] = _ignore,
        ended: Callable[[str], None] = _ignore,
    ) -> None:
        """Listen from now on, in any thread that compiles, until `stop`."""
        self._began, self._ended = began, ended
        self._listens = True
        _watches.append(self)
        event.register("numba:compile", self)

    def stop(self) -> None:
        """Listen no more; may be called again."""
        if self._listens:
            self._listens = False
            _watches.remove(self)
            event.unregister("numba:compile", self)

    def on_start(self, event: Any) -> None:
        """Tell the name."""
        self._tell(self._began, event.data["dispatcher"])

    def on_end(self, event: Any) -> None:
        """Tell the name."""
        self._tell(self._ended, event.data["dispatcher"])

    @staticmethod
    def _tell(tell: Callable[[str], None], dispatcher: Any) -> None:
        # Others of this process may compile functions of their own with numba.
        if isinstance(dispatcher._cache, KernelCache):
            tell(dispatcher.__name__)
