"""A renderer with a scene, here or in a process of its own: two that use EGL can't share one."""

from __future__ import annotations

from collections.abc import Callable
import multiprocessing
from multiprocessing.connection import Connection
import time
from typing import Any, Protocol

import numpy as np

from benchmarks.cameras.engines import Engine, Ours
from benchmarks.cameras.scenes import CameraScene
from scene_graph_ros.geometry.perception import CameraIntrinsics

__all__ = ["Elsewhere", "Here", "Seat"]


class Seat(Protocol):
    """Where a renderer is."""

    kind: type[Engine]

    def load(self, scene: CameraScene, lens: CameraIntrinsics) -> str:
        """Have the renderer draw a scene; return why it can't, or ""."""

    def seconds(self, k: int, kinds: tuple[str, ...]) -> float:
        """Return what images of the k-th set of poses take of the processor, poses included."""

    def depth(self, k: int) -> np.ndarray:
        """Return depths (height, width), metres, inf where nothing is."""

    def unrounded(self, k: int) -> np.ndarray:
        """Return the same of our renderer before they are float32."""

    def close(self) -> None:
        """Give back what it has."""


class Here:
    """In this process."""

    def __init__(self, kind: type[Engine]) -> None:
        self.kind = kind
        self._engine: Engine | None = None

    def load(self, scene: CameraScene, lens: CameraIntrinsics) -> str:
        """See Seat."""
        if self._engine is not None:
            self._engine.close()
        self._engine = None
        try:
            self._engine = self.kind(scene, lens)
        except ImportError as error:
            return f"it is not installed: {error}"
        except RuntimeError as error:
            return str(error)
        return ""

    def seconds(self, k: int, kinds: tuple[str, ...]) -> float:
        """See Seat."""
        assert self._engine is not None
        begin = time.process_time()
        self._engine.ask(k, kinds)
        return time.process_time() - begin

    def depth(self, k: int) -> np.ndarray:
        """See Seat."""
        assert self._engine is not None
        return self._engine.depth(self._engine.ask(k, ("depth",)))

    def unrounded(self, k: int) -> np.ndarray:
        """See Seat."""
        assert isinstance(self._engine, Ours)
        return self._engine.unrounded(k)

    def close(self) -> None:
        """See Seat."""
        if self._engine is not None:
            self._engine.close()


def _serve(kind: type[Engine], pipe: Connection) -> None:
    """Do what comes through the pipe, in the one thread that draws, until there is no more."""
    seat = Here(kind)
    while True:
        try:
            name, arguments = pipe.recv()
        except EOFError:
            return
        pipe.send(getattr(seat, name)(*arguments))


class Elsewhere:
    """In a process of its own, which ends with ``close``; raises EOFError where it crashes."""

    def __init__(self, kind: type[Engine]) -> None:
        self.kind = kind
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(kind, theirs), daemon=True)
        self._process.start()
        theirs.close()
        self.load: Callable[..., str] = self._remote("load")
        self.seconds: Callable[..., float] = self._remote("seconds")
        self.depth: Callable[..., np.ndarray] = self._remote("depth")
        self.unrounded: Callable[..., np.ndarray] = self._remote("unrounded")

    def _remote(self, name: str) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            self._pipe.send((name, arguments))
            return self._pipe.recv()

        return call

    def close(self) -> None:
        """End the process."""
        self._pipe.close()
        self._process.join()
