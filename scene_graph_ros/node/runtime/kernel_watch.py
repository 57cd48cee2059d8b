"""Says when kernels have to be compiled, which can make the first answers take minutes."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry.compile_progress import leave_it_to_others
from scene_graph_ros.geometry.compiled.readiness import Compilations, why_not_ready
from scene_graph_ros.warmup.groups import MAIN

__all__ = ["KernelWatch"]

_MEANING = (
    "the first answers may take minutes; `python -m scene_graph_ros.warmup` compiles them once, "
    "into a folder that must be writable (SCENE_GRAPH_ROS_KERNEL_CACHE names another)"
)


class KernelWatch:
    """Warns once: at the start where that is known, else when the first kernel is compiled."""

    def __init__(self, logger: Any) -> None:
        """Look at the cache of kernels, and watch until `stop`."""
        self._logger = logger
        problem = why_not_ready(MAIN)
        self._is_said = bool(problem)
        if problem:
            logger.warning(f"{problem}: {_MEANING}")
        self._compilations = Compilations(self._begins)
        leave_it_to_others()

    def stop(self) -> None:
        """Watch no more."""
        self._compilations.stop()

    def _begins(self, kernel: str) -> None:
        if not self._is_said:
            self._is_said = True
            self._logger.warning(
                f"kernel {kernel} has to be compiled, as it is not in the cache any more, or "
                f"damaged there: {_MEANING}"
            )
