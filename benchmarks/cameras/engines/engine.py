"""What every renderer of the comparison offers."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from benchmarks.cameras.scenes import CameraScene
from scene_graph_ros.geometry.perception import CameraIntrinsics

__all__ = ["KINDS", "Engine", "distinct_colors"]

KINDS = ("depth", "label", "color")


class Engine(Protocol):
    """One renderer with one scene, before a camera at the origin that looks along z.

    Its constructor raises ImportError where it is not installed, and RuntimeError where it can't
    draw this scene or has nothing to draw with.
    """

    name: str
    kinds: tuple[str, ...]
    """Of KINDS, those that it has."""

    def __init__(self, scene: CameraScene, lens: CameraIntrinsics) -> None: ...

    def ask(self, k: int, kinds: tuple[str, ...]) -> Any:
        """Give every body its pose of the k-th set, and render images of these kinds."""

    def depth(self, answer: Any) -> np.ndarray:
        """Return the depths (height, width) of an answer, metres, inf where nothing is."""

    def close(self) -> None:
        """Give back what the middle of a run should not keep."""


def distinct_colors(count: int) -> np.ndarray:
    """Return a colour (count, 3) for each body, between 0.2 and 1."""
    return np.random.default_rng(0).uniform(0.2, 1.0, (count, 3))
