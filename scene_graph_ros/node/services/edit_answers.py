"""Answers to edits of the scene: made one after another, recorded, and followed by the node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from msg_adapters.errors import UnavailableError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.garbage_collection import at_rest
from scene_graph_ros.node.services.bodies import prepare
from scene_graph_ros.node.services.replies import Replies
from scene_graph_ros.node.world.edits import EDITS, Tools
from scene_graph_ros.node.world.handles import Handle
from scene_graph_ros.node.world.scene import Edit
from scene_graph_ros.node.world.world import World, WorldSnapshot

if TYPE_CHECKING:
    from scene_graph_ros.node.recording.recorder import Recorder

__all__ = ["EditAnswers", "EditHooks"]

_LARGE_EDITS = {"LoadScene"}
"""Those that make so many objects that the garbage collector had better rest meanwhile; after a
small one it would have more to look through at once than it has otherwise."""


@dataclass(frozen=True)
class EditHooks:
    """Steps around an edit.

    ``prepare`` gets the snapshot that is about to count, ``changed`` follows one that counts;
    ``recorder`` returns the recorder, None without; ``topics`` a snapshot's topics by source, for
    "poses" or "configurations".
    """

    prepare: Callable[[WorldSnapshot], None]
    changed: Callable[[], None]
    recorder: Callable[[], Recorder | None]
    topics: Callable[[WorldSnapshot, str], Mapping[str, str]]


class EditAnswers:
    """The services of ``EDITS``."""

    def __init__(
        self,
        world: World,
        tools: Tools,
        replies: Replies,
        hooks: EditHooks,
        *,
        parameter: Callable[[str], Any],
        logger: Any,
    ) -> None:
        """Change ``world``; ``tools`` read files and descriptions."""
        self._world, self._tools, self._replies, self._hooks = world, tools, replies, hooks
        self._parameter, self._logger = parameter, logger

    def answer_to(self, name: str) -> Callable[[Any, Any], Any]:
        """Return the function that makes the edit ``name`` and fills its response."""
        handler = EDITS[name]

        def answer(request: Any, response: Any) -> Any:
            try:
                if not self._parameter("allow_editing"):
                    raise UnavailableError("the parameter allow_editing is false")
                snapshot, handles = self._world.snapshot, self._world.handles
                resolve = self._tools.resolve
                with at_rest() if name in _LARGE_EDITS else nullcontext():
                    prepare(name, request, snapshot.names, snapshot.inspector, resolve)
                    snapshot = self._edit(name, handler, request, response)
                self._hooks.changed()
                if name == "RegisterSource":
                    self._tell_claim(response.source.name, handles)
                    topics = self._hooks.topics(snapshot, "poses")
                    response.pose_topic = topics.get(response.source.name, "")
                elif name == "RegisterDeformableGeometry":
                    topics = self._hooks.topics(snapshot, "configurations")
                    response.configuration_topic = topics[request.source.name]
                self._replies.finish(response, snapshot)
            except Exception as error:  # noqa: BLE001 - every request is answered
                return self._replies.refuse(name, type(response)(), error)
            return response

        return answer

    def _tell_claim(self, name: str, before: Mapping[str, Handle]) -> None:
        """Log that somebody claimed a source, where the last edit did that."""
        if self._world.handles[name] is not before.get(name) and name in before:
            self._logger.info(
                f"source {quoted(name)} is claimed: the first who asked for it has its handle"
            )

    def _edit(self, name: str, handler: Any, request: Any, response: Any) -> WorldSnapshot:
        """Make an edit, and have it recorded where that is asked for."""
        recorder = self._hooks.recorder()
        if recorder is None:
            _, snapshot = self._world.edit(
                lambda edit: handler(request, response, edit, self._tools), self._hooks.prepare
            )
            return snapshot
        text = self._tools.scene_text(request.resource if name == "LoadScene" else "")

        def change(edit: Edit) -> tuple[int, dict[int, list[float]]]:
            first_id = recorder.next_id()
            handler(request, response, edit, self._tools)
            return first_id, {int(f): edit.initial_poses[f].ravel().tolist() for f in edit.rehung}

        def done(changed: tuple[int, dict[int, list[float]]]) -> None:
            first_id, rehung = changed
            ids = [*getattr(response, "frame_ids", ()), *getattr(response, "geometry_ids", ())]
            numbers = [int(i) for i in ids]
            recorder.edited(name, request, first_id, text=text, ids=numbers, rehung=rehung)

        _, snapshot = self._world.edit(change, self._hooks.prepare, done=done)
        return snapshot
