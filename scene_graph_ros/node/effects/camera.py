"""A camera: images of the newest snapshot, in a thread of its own, for subscribers.

Imported only while the scene has a camera, and once the kernels of cameras are compiled.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
import importlib
import threading
import time
import traceback
from typing import Any, NamedTuple

from msg_adapters.poses import tf_to_msg
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.perception import CameraDescription
from scene_graph_ros.node.effects.camera_frame import CameraFrame, optical_frame
from scene_graph_ros.node.effects.camera_topics import CameraTopic, open_topics
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.effects.frames import FrameThread
from scene_graph_ros.node.runtime.names import TRANSFORMS
from scene_graph_ros.node.runtime.qos import contact_qos
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["CameraEffect"]

_RECENT = 100
"""Frames whose times are remembered."""


class _Transforms(NamedTuple):
    """Where optical frames are told, and the class of those messages."""

    outlet: Outlet
    kind: Any

    @classmethod
    def open(cls, host: Host) -> _Transforms | None:
        """Advertise them; None where their messages are not installed."""
        try:
            kind = importlib.import_module("tf2_msgs.msg").TFMessage
        except ModuleNotFoundError:
            return None
        return cls(Outlet(host, kind, TRANSFORMS, contact_qos()), kind)


class CameraEffect:
    """Publishes the topics of one camera, of one snapshot with one stamp at a time.

    Images are rendered for subscribers alone. An error turns this camera off, and nothing else,
    until the scene changes.
    """

    def __init__(self, host: Host, camera: CameraDescription) -> None:
        """Advertise the topics of ``camera``."""
        self._host, self._camera = host, camera
        self._topics = open_topics(host, camera)
        self._transforms = _Transforms.open(host)
        self._frames = FrameThread(f"camera {camera.name}", camera.rate, self._make)
        self._publishing = threading.Lock()
        self._is_closed = False
        self._frame: CameraFrame | None = None
        self._told_version: dict[str, int] = {}
        self._failed_version = -1
        self._failure = self._stale = ""
        self._rendered: Counter[str] = Counter()
        self._seconds: deque[float] = deque(maxlen=_RECENT)
        self._count = 0

    def is_heard(self) -> bool:
        """Tell whether any of its topics has subscribers."""
        return any(topic.outlet.is_heard() for topic in self._topics)

    def has_work(self) -> bool:
        """Tell whether somebody listens."""
        return self.is_heard()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: slow work is done in the camera's thread, which nobody waits for."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Hand the snapshot to the camera's thread."""
        if snapshot.scene_version != self._failed_version:
            self._frames.offer(snapshot)

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: images are of their moment."""

    def close(self) -> None:
        """Stop being advertised."""
        self._frames.stop()
        with self._publishing:
            self._is_closed = True
            for topic in self._topics:
                topic.outlet.close()
            if self._transforms is not None:
                self._transforms.outlet.close()

    def failure(self) -> str:
        """Say why the camera is off, "" while it is not."""
        return self._failure

    def stale(self) -> str:
        """Say that the camera's frame is gone, "" while it is there."""
        return self._stale

    def recent_seconds(self) -> list[float]:
        """Return the times (s) of the last frames, from the snapshot to the messages."""
        return list(self._seconds)

    def count(self) -> int:
        """Return the number of frames made."""
        return self._count

    def counters(self) -> Mapping[str, Any]:
        """Return counts of images rendered, late frames, and messages published."""
        messages = {f"messages of {t.name.split('/', 3)[3]}": t.outlet for t in self._topics}
        return {
            "frames": self._count,
            "frames skipped, as they were late": self._frames.late,
            **{f"{kind} images rendered": n for kind, n in sorted(self._rendered.items())},
            **{name: outlet.messages for name, outlet in messages.items()},
        }

    # In the camera's own thread.

    def _make(self, snapshot: WorldSnapshot) -> None:
        if snapshot.scene_version == self._failed_version:
            # It was offered while the frame was made that failed.
            return
        begin = time.perf_counter()
        try:
            frame = self._placed(snapshot)
            if frame is not None:
                self._publish_all(frame)
                self._failure = ""
                self._count += 1
                self._seconds.append(time.perf_counter() - begin)
        except Exception as error:  # noqa: BLE001 - one camera never costs anything else
            if not self._is_closed:
                self._failed_version = snapshot.scene_version
                self._failure = f"{type(error).__name__}: {error}"
                self._host.node.get_logger().error(
                    f"camera {self._camera.name} is off until the scene changes:\n"
                    f"{traceback.format_exc()}"
                )

    def _placed(self, snapshot: WorldSnapshot) -> CameraFrame | None:
        """Return the frame for a snapshot, the one there is for the same; None while stale."""
        if self._frame is None or self._frame.snapshot.sequence != snapshot.sequence:
            self._frame = None
            try:
                self._frame = CameraFrame(self._camera, snapshot)
            except UnknownIdError as error:
                self._become_stale(f"stale: {error}")
                return None
        self._stale = ""
        return self._frame

    def _become_stale(self, reason: str) -> None:
        if not self._stale:
            self._host.node.get_logger().warning(f"camera {self._camera.name} is {reason}")
        self._stale = reason

    def _publish_all(self, frame: CameraFrame) -> None:
        due = [topic for topic in self._topics if self._is_due(topic, frame)]
        rendered = frame.render(frozenset().union(*(topic.kinds for topic in due)))
        self._rendered.update(kind.value for kind in rendered)
        for topic in due:
            self._publish(topic.outlet, frame.message(topic.name, topic.make))
        shows = any(topic.kinds for topic in due)
        transforms = self._transforms
        if shows and transforms is not None and transforms.outlet.is_due():
            placed = tf_to_msg(
                [optical_frame(self._camera)],
                frame.X_WC[None],
                stamp_ns=frame.snapshot.stamp,
                frame_id=self._host.world_frame,
            )
            self._publish(transforms.outlet, transforms.kind(transforms=placed))

    def _is_due(self, topic: CameraTopic, frame: CameraFrame) -> bool:
        """Tell whether somebody is to get a message; of the scene, when it or a reader is new."""
        if not topic.outlet.is_due():
            return False
        if not topic.is_of_scene:
            return True
        version = frame.snapshot.scene_version
        is_new = self._told_version.get(topic.name) != version
        self._told_version[topic.name] = version
        return topic.outlet.take_newcomers() or is_new

    def _publish(self, outlet: Outlet, message: Any) -> None:
        with self._publishing:
            if not self._is_closed:
                outlet.publish(message)
