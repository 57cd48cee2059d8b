"""A recorded node's world again: the same messages and edits, between the same updates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message

from msg_adapters.definitions import layout_of
import scene_graph_msgs.srv
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.model.ids import continue_after
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.recording.events import bytes_of, decode, VERSION
from scene_graph_ros.node.world.edits import EDITS, Tools
from scene_graph_ros.node.world.inputs import (
    BASE_POSES,
    JOINT_POSES,
    make_channel,
    message_type,
    POSES,
)
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.queued_channel import QueuedChannel
from scene_graph_ros.node.world.scene import Edit, SourceRecord
from scene_graph_ros.node.world.scenes import Described, SceneLoader
from scene_graph_ros.node.world.source_channel import apply_kept, SourceChannel
from scene_graph_ros.node.world.source_topics import CAMERA_INFO, DEPTH_IMAGES, HEIGHTS, VOXELS
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World, WorldSnapshot
from scene_graph_ros.replay.reader import Recorded, RecordingError

__all__ = ["Replay"]

_EVENT_KIND = "std_msgs/msg/String"
_CONFIGURATIONS = "configurations"
_POINTS = "points"


class Replay:
    """Goes through a recording; `snapshot` is the world of the last update.

    Ids are given out as in the node that was recorded, so a process replays once and does nothing
    else.
    """

    def __init__(self) -> None:
        """Wait for the beginning of a recording."""
        self.parameters: Mapping[str, Any] = {}
        self.snapshot: WorldSnapshot | None = None
        self.updates = self.edits = self.inputs = self.left_out = 0
        self._world: World | None = None
        self._texts: dict[Path, str] = {}
        self._channels: dict[tuple[str, str], SourceChannel[Any, Any]] = {}
        self._owners: dict[str, tuple[str, str]] = {}
        self._static: dict[tuple[str, str, str], bool] = {}

    @property
    def world(self) -> World:
        """The world. Raises RecordingError before its beginning was taken."""
        if self._world is None:
            raise RecordingError("the recording has no beginning: no event 'begin' comes first")
        return self._world

    def take(self, message: Recorded) -> bool:
        """Apply a message; return False for one that the node put out.

        Raises RecordingError where the world differs from the recorded one, or can't be made.
        """
        if message.kind == _EVENT_KIND:
            self._do(message)
            return True
        if message.qos:
            return False
        key = self._owners.get(message.topic)
        if key is None:
            raise RecordingError(f"nothing says what takes the messages on {message.topic}")
        self._store(key, message.topic, message.data, message.time)
        return True

    def _do(self, message: Recorded) -> None:
        try:
            event = decode(message.data)
            does = getattr(self, f"_on_{event.pop('event')}")
            does(message.time, **event)
        except RecordingError:
            raise
        except (
            AttributeError,
            LookupError,
            TypeError,
            ValueError,
            OSError,
            SceneGraphError,
        ) as error:
            raise RecordingError(
                f"the event at {message.time} ns can't be replayed: {error}"
            ) from error

    def _on_attached(self, time: int, *, version: int, node: str) -> None:
        raise RecordingError(
            f"it was recorded beside {node}, which ran already: it can be published, not replayed"
        )

    def _on_begin(
        self,
        time: int,
        *,
        version: int,
        id: int,  # noqa: A002 - the event's own name for it
        parameters: Mapping[str, Any],
        path: str,
        text: str,
        given: bool,
    ) -> None:
        if version != VERSION:
            raise RecordingError(
                f"the recording has version {version}, this replays {VERSION}: it can be published"
            )
        if given:
            raise RecordingError(
                "the node was given its model by a program, which is not in the recording: "
                "it can be shown, not replayed"
            )
        continue_after(id)
        self.parameters = parameters
        if path:
            self._texts[Path(path)] = text
        self._loader = SceneLoader(
            parameters["package_paths"], message_type, EFFECT_NAMES, self._texts
        )
        self._tools = Tools(
            self._loader.resolve, message_type, self._loader.load_request, self._loader.text
        )
        self._world = World(None, world_frame=parameters["world_frame"])
        self._world.set_accuracy(parameters["accuracy"])
        if path:
            self._world.edit(lambda edit: self._loader.load(edit, path))

    def _on_edit(
        self,
        time: int,
        *,
        service: str,
        id: int,  # noqa: A002 - the event's own name for it
        layout: str,
        request: str,
        path: str,
        text: str,
        ids: list[int],
        rehung: Mapping[str, list[float]],
    ) -> None:
        kind = getattr(scene_graph_msgs.srv, service)
        if layout != layout_of(kind.Request):
            raise RecordingError(
                f"the request of {service} at {time} ns has other fields than such requests have"
                " now: the version that recorded it can replay it"
            )
        asked, answer = deserialize_message(bytes_of(request), kind.Request), kind.Response()
        if path:
            self._texts[Path(path)] = text
            asked.resource = path

        def change(edit: Edit) -> None:
            continue_after(id)
            if hasattr(asked, "source"):
                # Recordings have no tokens.
                handle = edit.handles.get(asked.source.name)
                asked.source.token = 0 if handle is None else handle.token
            EDITS[service](asked, answer, edit, self._tools)
            for frame in edit.rehung:
                edit.initial_poses[frame] = np.reshape(rehung[str(int(frame))], (4, 4))

        self.world.edit(change)
        got = [*getattr(answer, "frame_ids", ()), *getattr(answer, "geometry_ids", ())]
        if [int(i) for i in got] != ids:
            raise RecordingError(f"{service} gave out ids {got[:5]}... in place of {ids[:5]}...")
        self.edits += 1

    def _on_described(
        self,
        time: int,
        *,
        source: str,
        text: str,
        id: int,  # noqa: A002 - the event's own name for it
        rehung: Mapping[str, list[float]],
    ) -> None:
        def change(edit: Edit) -> Described:
            continue_after(id)
            described = self._loader.describe(edit, source, text)
            for frame in edit.rehung:
                edit.initial_poses[frame] = np.reshape(rehung[str(int(frame))], (4, 4))
            return described

        self.world.edit(change, done=lambda described: described.count())
        self.edits += 1

    def _on_channel(self, time: int, *, source: str, noun: str, topic: str, static: bool) -> None:
        record, key = self.world.records[source], (source, noun)
        known = self._channels.get(key)
        if known is None or known.record is not record:
            self._channels[key] = self._channel(noun, record)
        self._owners.setdefault(topic, key)
        self._static[source, noun, topic] = static

    def _channel(self, noun: str, record: SourceRecord) -> SourceChannel[Any, Any]:
        if noun == _POINTS:
            from scene_graph_ros.node.world.point_channel import PointChannel

            most = self.parameters["max_points_per_cloud"]
            return PointChannel(record, Intake(record.name, _ignore), most)
        if noun == HEIGHTS:
            from scene_graph_ros.node.world.height_channel import HeightChannel

            return HeightChannel(record, Intake(record.name, _ignore))
        if noun == VOXELS:
            from scene_graph_ros.node.world.voxel_channel import VoxelChannel

            most, frame = self.parameters["max_voxels_per_map"], self.world.world_frame
            return VoxelChannel(record, Intake(record.name, _ignore), most, frame)
        if noun in (CAMERA_INFO, DEPTH_IMAGES):
            from scene_graph_ros.node.world.depth_channel import DepthChannel, InfoChannel

            intake = Intake(record.name, _ignore)
            if noun == CAMERA_INFO:
                return InfoChannel(record, intake)
            return DepthChannel(record, intake, self.parameters["max_points_per_cloud"])
        if noun != _CONFIGURATIONS:
            return make_channel(noun, record, _ignore, self.world.world_frame)
        from scene_graph_ros.node.world.configurations import ConfigurationChannel

        intake = Intake(record.name, _ignore, noun="geometry")
        return ConfigurationChannel(record, intake, self.world.world_frame)

    def _on_input(self, time: int, *, source: str, noun: str, topic: str, data: str) -> None:
        self._store((source, noun), topic, bytes_of(data), time)

    def _store(self, key: tuple[str, str], topic: str, data: bytes, time: int) -> None:
        self._channels[key].store(data, time, is_static=self._static[*key, topic])
        self.inputs += 1

    def _on_update(self, time: int, *, limits: list[int], sequence: int) -> None:
        world, told = self.world, TimeLimits(*limits)
        with world.lock:
            moved, deformed, sensed = set[str](), set[str](), set[str]()
            targets: dict[str, tuple[Callable[[str], Any], set[str]]] = {
                _CONFIGURATIONS: (world.deformables.get, deformed),
                _POINTS: (world.clouds.get, sensed),
                CAMERA_INFO: (world.clouds.get, set()),
                DEPTH_IMAGES: (world.clouds.get, sensed),
                HEIGHTS: (world.fields.get, sensed),
                VOXELS: (world.grids.get, sensed),
            }
            for name, noun in sorted(self._channels, key=_in_order):
                channel, record = self._channels[name, noun], world.records.get(name)
                find, changed = targets.get(noun, (world.frames, moved))
                is_sensor = noun in (_POINTS, CAMERA_INFO, DEPTH_IMAGES)
                whose = record.filled if is_sensor and record is not None else name
                if is_sensor:
                    world.note_poses()
                if apply_kept(channel, record, partial(find, whose), told) is not None:
                    changed.add(whose)
                if is_sensor and whose in world.clouds and world.clouds[whose].expire(told.now):
                    sensed.add(whose)
            if moved or deformed or sensed:
                world.commit(moved, time, deformed, sensed)
        self.snapshot = world.snapshot
        self.updates += 1
        if world.snapshot.sequence != sequence:
            raise RecordingError(
                f"the update at {time} ns made version {world.snapshot.sequence} of the world, "
                f"in the node it was version {sequence}"
            )

    def _on_accuracy(self, time: int, *, value: str) -> None:
        self.world.set_accuracy(value)

    def _on_forget(self, time: int, *, after: int | None) -> None:
        if after is None:
            for channel in self._channels.values():
                channel.take()
        last = UNSTAMPED if after is None else after
        self.world.forget_stamps(last)
        for channel in self._channels.values():
            if isinstance(channel, QueuedChannel):
                channel.forget(last)

    def _on_stop(self, time: int) -> None:
        self._channels.clear()
        self._owners.clear()

    def _on_left_out(
        self,
        time: int,
        *,
        topic: str,
        bytes: int,  # noqa: A002 - the event's own name for it
    ) -> None:
        """Count a message that was too large to be recorded: the world goes on without it."""
        self.left_out += 1

    def _on_lost(self, time: int, *, count: int) -> None:
        raise RecordingError(
            f"at {time} ns {count} messages were dropped, since the disk was too slow: the world "
            "from there on is not known"
        )


def _in_order(key: tuple[str, str]) -> int:
    """Return when a channel's messages are applied, in an update of the node."""
    sensed = (_CONFIGURATIONS, _POINTS, CAMERA_INFO, DEPTH_IMAGES, HEIGHTS, VOXELS)
    order = (POSES, BASE_POSES, JOINT_POSES, *sensed)
    return order.index(key[1])


def _ignore(warning: str) -> None:
    """Leave a warning about a message to the node that was recorded, which gave it."""
