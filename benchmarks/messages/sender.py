"""Publishes poses of all frames of the scene: ready bytes, so that the sender is no bottleneck.

Reads lines ``{"rate": Hz, "seconds": s}`` and answers each with ``{"sent": n}`` when it is done.
"""

from __future__ import annotations

import argparse
import json
import sys
import time

from geometry_msgs.msg import Transform
import rclpy
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import MultiDOFJointState

from benchmarks.messages.scene import frame_names, poses, SOURCE
from msg_adapters.wire.fields import Patchable
from msg_adapters.wire.layout import layout

__all__ = ["pose_template"]

_STEPS = 64
"""Different sets of poses, made before anything is measured and sent in turn."""


def pose_template(count: int) -> Patchable:
    """Return the bytes of a pose message of the scene, with the places of stamp and poses."""
    message = MultiDOFJointState(
        joint_names=frame_names(count), transforms=[Transform() for _ in range(count)]
    )
    message.header.frame_id = "world"
    fields = layout(message)
    places = fields.begins("transforms.translation.x")
    return Patchable(serialize_message(message), [fields.begin("header.stamp.sec")], places, 7)


def main() -> None:
    """Publish as standard input says, until it ends."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.messages.sender", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--frames", type=int, required=True)
    count = parser.parse_args().frames
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("sender")
    publisher = node.create_publisher(MultiDOFJointState, f"{SOURCE}/poses", 10)
    template = pose_template(count)
    sets = [poses(count, step) for step in range(_STEPS)]
    total = 0
    for line in sys.stdin:
        wanted = json.loads(line)
        period, begin, sent = 1.0 / wanted["rate"], time.monotonic(), 0
        while sent * period < wanted["seconds"]:
            time.sleep(max(0.0, begin + sent * period - time.monotonic()))
            template.put_numbers(sets[total % _STEPS])
            template.put_stamp(time.time_ns())
            publisher.publish(template.data())
            sent, total = sent + 1, total + 1
        sys.stdout.write(json.dumps({"sent": sent}) + "\n")
        sys.stdout.flush()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(0)
