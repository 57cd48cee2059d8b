"""The recording of a node, imported and begun where its parameter asks for one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

from rclpy.node import Node

from msg_adapters.errors import UnavailableError
from scene_graph_ros.node.runtime.parameters import PARAMETERS

if TYPE_CHECKING:
    from scene_graph_ros.node.recording.recorder import Recorder

__all__ = ["RecordingOnDemand"]


class RecordingOnDemand:
    """The recorder while there is one, and whether a recording has failed."""

    def __init__(self, node: Node, parameter: Callable[[str], Any]) -> None:
        """Record ``node`` by its parameters ``record`` and ``record_max_bytes``."""
        self._node, self._parameter = node, parameter
        self.recorder: Recorder | None = None
        self.has_failed = False

    def begin(self, scene_text: Callable[[], tuple[str, str]], is_given: bool) -> None:
        """Begin where the parameter asks for it, before the world is made.

        ``scene_text()`` is the path and the text of the scene file, ``is_given`` tells of a scene
        graph that the program gave. Raises UnavailableError where a package is missing.
        """
        path = self._parameter("record")
        if not path:
            return
        try:
            from scene_graph_ros.node.recording.recorder import Recorder
        except ModuleNotFoundError as error:
            raise UnavailableError(f"the parameter record needs a package: {error}") from error

        text = scene_text()
        recorder = Recorder(self._node, path, self._parameter("record_max_bytes"))
        values = {each.name: self._parameter(each.name) for each in PARAMETERS}
        recorder.begin(values, text, is_given)
        self.recorder = recorder

    def end(self) -> None:
        """Close the recording, where there is one."""
        recorder, self.recorder = self.recorder, None
        if recorder is not None:
            recorder.close()
            self.has_failed |= bool(recorder.failure())
