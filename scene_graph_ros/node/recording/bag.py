"""A folder as rosbag2 has it, with one MCAP file, written in chunks that outlive a kill.

Chunks are compressed and handed to the system whole. ``metadata.yaml`` is there from the start,
and true from the end on.
"""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

__all__ = ["Bag"]

_OWN_PACKAGE = "scene_graph_msgs"
"""Its messages are described by the files that it installs; those of Jazzy rosbags knows."""

_EMPTY = """\
rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  duration: {{nanoseconds: 0}}
  starting_time: {{nanoseconds_since_epoch: {start}}}
  message_count: 0
  topics_with_message_count: []
  compression_format: ''
  compression_mode: ''
  relative_file_paths: [{file}]
  files:
  - path: {file}
    starting_time: {{nanoseconds_since_epoch: {start}}}
    duration: {{nanoseconds: 0}}
    message_count: 0
  custom_data:
    complete: 'false'
  ros_distro: jazzy
"""


class Bag:
    """Writes messages in their order; to be used by one thread.

    Each method raises OSError where the disk does.
    """

    def __init__(self, folder: Path, start: int) -> None:
        """Make the folder, which must not be there; ``start`` is the time in nanoseconds.

        Raises FileExistsError where it is there, OSError where it can't be made.
        """
        if folder.exists():
            raise FileExistsError(f"{folder} exists already, and a recording never overwrites")
        self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._writer.open()
        self._types = get_typestore(Stores.ROS2_JAZZY)
        self._described: set[str] = set()
        self._connections: dict[tuple[str, str], Any] = {}
        storage: Any = self._writer.storage
        self._storage = storage
        self._whole = self._storage.bio.tell()
        text = _EMPTY.format(start=start, file=self._storage.path.name)
        (folder / "metadata.yaml").write_text(text, encoding="utf8")

    @property
    def size(self) -> int:
        """Bytes of the file and of the chunk that is not in it yet."""
        return int(self._storage.bio.tell() + self._storage.chunk.bio.tell())

    def write(self, topic: str, kind: str, qos: QoSProfile | None, time: int, data: bytes) -> None:
        """Write a message of type ``kind`` (``package/msg/Name``); ``time`` in nanoseconds."""
        self.copy(topic, kind, [] if qos is None else [_profile(qos)], time, data)

    def copy(self, topic: str, kind: str, profiles: list[Qos], time: int, data: bytes) -> None:
        """Write a message of another recording, with the profiles that it says were offered."""
        connection = self._connections.get((topic, kind))
        if connection is None:
            self._describe(kind)
            connection = self._connections[topic, kind] = self._writer.add_connection(
                topic,
                kind,
                typestore=self._types,
                offered_qos_profiles=profiles,
            )
        self._writer.write(connection, time, data)

    def flush(self) -> None:
        """Hand all messages so far to the system."""
        if self._storage.chunk.msgs:
            self._storage.close_chunk()
        self._storage.bio.flush()
        if not os.fstat(self._storage.bio.fileno()).st_nlink:
            raise FileNotFoundError(errno.ENOENT, "was removed", str(self._storage.path))
        self._whole = self._storage.bio.tell()

    def close(self) -> None:
        """Write the index, and the true metadata."""
        self.flush()
        self._writer.set_custom_data("complete", "true")
        self._writer.close()

    def abort(self) -> None:
        """Leave the whole messages in the file, without an index: the disk takes no more."""
        raw = self._storage.bio.raw
        raw.truncate(self._whole)
        raw.close()

    def _describe(self, kind: str) -> None:
        """Learn a message of ours, and those that it is made of."""
        if not kind.startswith(f"{_OWN_PACKAGE}/") or self._described:
            return
        folder = Path(get_package_share_directory(_OWN_PACKAGE)) / "msg"
        types: dict[str, Any] = {}
        for path in sorted(folder.glob("*.msg")):
            name = f"{_OWN_PACKAGE}/msg/{path.stem}"
            types.update(get_types_from_msg(path.read_text(encoding="utf8"), name))
            self._described.add(name)
        self._types.register(types)


def _profile(qos: QoSProfile) -> Qos:
    """Return a profile as rosbag2 keeps it, so that a player offers the same."""
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    forever = QosTime(9223372036, 854775807)
    return Qos(
        QosHistory.KEEP_LAST,
        qos.depth,
        QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        forever,
        forever,
        QosLiveliness.AUTOMATIC,
        forever,
        avoid_ros_namespace_conventions=False,
    )
