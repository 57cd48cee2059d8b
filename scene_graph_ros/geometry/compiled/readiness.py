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
)

__all__ = ["Compilations", "ready_marker", "why_not_ready"]


def ready_marker() -> Path:
    """Return the file that is there once all kernels of these sources are compiled and kept."""
    return cache_root() / f"ready-{digest_of_everything()}"


def why_not_ready() -> str:
    """Say why this process will have to compile kernels, "" where it will find all of them."""
    if numba_config.DISABLE_JIT:
        return ""
    problem = cache_problem()
    if problem or ready_marker().exists():
        return problem
    return f"the kernels of this version have not all been compiled into {cache_root()} yet"


class Compilations(event.Listener):
    """Calls ``tell`` with the name of each kernel that this process begins to compile."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        """Listen from now on, in whatever thread compiles, until `stop`."""
        self._tell = tell
        self._listens = True
        event.register("numba:compile", self)

    def stop(self) -> None:
        """Listen no more; may be called again."""
        if self._listens:
            self._listens = False
            event.unregister("numba:compile", self)

    def on_start(self, event: Any) -> None:
        """Tell."""
        self._tell(event.data["dispatcher"].__name__)

    def on_end(self, event: Any) -> None:
        """Do nothing."""
