"""Robots become as topics describe them, one after another, beside all else."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import threading
from typing import Any

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.own_threads import stop_at_exit
from scene_graph_ros.node.world.scene import Edit
from scene_graph_ros.node.world.scenes import Described, SceneLoader
from scene_graph_ros.node.world.world import World, WorldSnapshot

__all__ = ["Descriptions"]


class Descriptions:
    """A thread, started with the first text, that makes an edit of each."""

    def __init__(
        self,
        node: Any,
        world: World,
        loader: SceneLoader,
        prepare: Callable[[WorldSnapshot], object],
        recorder: Callable[[], Any],
        changed: Callable[[], None],
    ) -> None:
        """Edit ``world``; ``changed`` is called after each change of it."""
        self._logger = node.get_logger()
        self._world, self._loader, self._prepare = world, loader, prepare
        self._recorder, self._changed = recorder, changed
        self._condition = threading.Condition()
        self._waiting: deque[tuple[str, str, Callable[[str], None]]] = deque()
        self._is_stopped = False
        self._thread: threading.Thread | None = None
        stop_at_exit(self, Descriptions.stop)

    def describe(self, name: str, text: str, told: Callable[[str], None]) -> None:
        """Have a robot become as a text says; of texts that wait only the newest counts.

        ``told`` is called with the reason where it can't be used, and with "" where it is.
        """
        with self._condition:
            others = [one for one in self._waiting if one[0] != name]
            self._waiting = deque([*others, (name, text, told)])
            if self._thread is None and not self._is_stopped:
                self._thread = threading.Thread(target=self._run, name="descriptions", daemon=True)
                self._thread.start()
            self._condition.notify()

    def stop(self) -> None:
        """End the thread, after the edit that it is at."""
        with self._condition:
            self._is_stopped = True
            self._condition.notify()
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join()

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._waiting or self._is_stopped)
                if self._is_stopped:
                    return
                name, text, told = self._waiting.popleft()
            told(self._become(name, text))

    def _become(self, name: str, text: str) -> str:
        """Make the edit; return why it can't be made, or ""."""
        recorder = self._recorder()

        def change(edit: Edit) -> tuple[int, Described]:
            first_id = 0 if recorder is None else recorder.next_id()
            return first_id, self._loader.describe(edit, name, text)

        def done(changed: tuple[int, Described]) -> None:
            first_id, described = changed
            described.count()
            if recorder is not None:
                recorder.described(name, text, first_id, described.poses())

        try:
            (_, described), _ = self._world.edit(change, self._prepare, done)
        except Exception as error:  # noqa: BLE001 - a robot's description never costs the node
            reason = f"{type(error).__name__}: {quoted(str(error))}"
            if isinstance(error, SceneGraphError):
                reason = str(error)  # a sentence of ours, in which what others wrote is quoted
            text = f"robot {quoted(name)} stays as it is, as its description can't be used"
            self._logger.error(f"{text}: {reason}")  # noqa: TRY400 - the reason is for users
            return reason
        for warning in described.warnings:
            self._logger.warning(f"robot {quoted(name)}: {warning}")
        self._logger.info(f"robot {quoted(name)} is as its description says")
        self._changed()
        return ""
