"""Copies the whole messages of a recording that was cut off, with the index that it lacks."""

from __future__ import annotations

from pathlib import Path

from scene_graph_ros.replay.reader import RecordingReader

__all__ = ["repair"]


def repair(reader: RecordingReader, folder: Path) -> int:
    """Write the messages of a recording into a new ``folder``; return how many.

    Raises FileExistsError where it is there, RecordingError where there is nothing to read.
    """
    from rosbags.rosbag2.metadata import parse_qos

    from scene_graph_ros.node.recording.bag import Bag

    bag, count = None, 0
    for message in reader:
        if bag is None:
            bag = Bag(folder, message.time)
        profiles = parse_qos(message.qos) if message.qos else []
        bag.copy(message.topic, message.kind, profiles, message.time, message.data)
        count += 1
    if bag is not None:
        bag.close()
    return count
