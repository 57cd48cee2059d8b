"""How many images of a camera reach a reader on the same machine, with each transport.

Each transport is tried by a process of its own, since Fast DDS reads its profiles once:
``python -m benchmarks.messages.images TOPICS RELIABILITY FRAMES``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import Image, MultiDOFJointState, PointCloud2

from benchmarks.messages.holes import TRANSPORTS
from benchmarks.messages.processes import cpu_seconds, isolated, ROOT
from msg_adapters.poses import multi_dof_joint_state_to_msg

__all__ = ["images"]

_TRANSPORTS = {
    **TRANSPORTS,
    "large messages": {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "config" / "large_messages.xml"),
    },
}
_TOPICS = ("color/image", "depth/image", "points")
"""Listened to one at a time; ``measure`` takes any, and several."""

_FRAMES, _RATE, _BODIES = 90, 30.0, 50
_SETTLE = 2.0
"""Seconds that the last image may take."""


def scene() -> str:
    """Return a scene of bodies of four shapes before a camera of 640 x 480 pixels."""
    rng = np.random.default_rng(7)
    shapes = (
        "sphere, radius: 0.1",
        "box, size: [0.2, 0.15, 0.1]",
        "cylinder, radius: 0.07, length: 0.2",
        "capsule, radius: 0.06, length: 0.15",
    )
    lines = [
        "version: 1",
        "sources: [{name: cell}]",
        "frames: [{name: eye, source: cell}]",
        "geometries:",
    ]
    for i in range(_BODIES):
        xyz = rng.uniform((-1.2, -0.9, 1.5), (1.2, 0.9, 3.0)).round(3).tolist()
        shape = shapes[i % len(shapes)]
        lines.append(
            f"  - {{name: b{i}, source: cell, pose: {{xyz: {xyz}}}, label: {i},"
            f" shape: {{type: {shape}}}, color: {rng.uniform(size=3).round(2).tolist()}}}"
        )
    lines += [
        "cameras:",
        "  - {name: eye, source: cell, frame: eye, size: [640, 480], fov_y: 1, rate: 1000,",
        "     images: [color, depth, label, points]}",
    ]
    return "\n".join(lines) + "\n"


def measure(topics: list[str], is_reliable: bool, frames: int) -> dict[str, Any]:
    """Send poses, read raw images of ``topics``, and count those with a pose's stamp."""
    with isolated() as place:
        node = place.start_node(scene())
        context = rclpy.Context()
        rclpy.init(
            context=context, domain_id=place.domain, signal_handler_options=SignalHandlerOptions.NO
        )
        reader = rclpy.create_node("reader", context=context)
        qos = QoSProfile(depth=5)
        if not is_reliable:
            qos.reliability = ReliabilityPolicy.BEST_EFFORT
        arrived: dict[str, dict[int, float]] = {topic: {} for topic in topics}

        def take(topic: str, data: bytes) -> None:
            seconds, nanoseconds = np.frombuffer(data, np.uint32, 2, 4).tolist()
            arrived[topic].setdefault(10**9 * seconds + nanoseconds, time.time())

        for topic in topics:
            reader.create_subscription(
                PointCloud2 if topic == "points" else Image,
                f"/scene_graph/cameras/eye/{topic}",
                lambda data, topic=topic: take(topic, data),
                qos,
                raw=True,
            )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(reader)
        publisher = reader.create_publisher(MultiDOFJointState, "/cell/poses", 10)

        def spin(seconds: float) -> None:
            end = time.monotonic() + seconds
            while (left := end - time.monotonic()) > 0.0:
                executor.spin_once(timeout_sec=left)

        def send() -> int:
            stamp = time.time_ns()
            publisher.publish(
                multi_dof_joint_state_to_msg(
                    ["eye"], np.eye(4)[None], stamp_ns=stamp, frame_id="world"
                )
            )
            return stamp

        while not all(arrived.values()):
            place.check()
            send()
            spin(0.1)
        spin(_SETTLE)
        stamps, begin, cpu = [], time.monotonic(), cpu_seconds(node.pid)
        for k in range(frames):
            stamps.append(send())
            spin(max(begin + (k + 1) / _RATE - time.monotonic(), 0.0))
        share = (cpu_seconds(node.pid) - cpu) / (time.monotonic() - begin)
        spin(_SETTLE)
        delays = {t: [a[s] - 1e-9 * s for s in stamps if s in a] for t, a in arrived.items()}
        executor.shutdown()
        reader.destroy_node()
        rclpy.shutdown(context=context)
    return {
        "sent": frames,
        "arrived": {topic: len(values) for topic, values in delays.items()},
        "median": {
            t: float(np.median(values)) if values else None for t, values in delays.items()
        },
        "share": share,
    }


def images(is_quick: bool) -> None:
    """Print how many images come, and how late, with each transport and reliability."""
    frames = 15 if is_quick else _FRAMES
    print(f"of {frames} images of 640 x 480 pixels at {_RATE:g} Hz; median from stamp to receipt")
    for transport, environment in _TRANSPORTS.items():
        for reliability in ("best effort", "reliable"):
            for topic in _TOPICS:
                command = [sys.executable, "-m", "benchmarks.messages.images"]
                done = subprocess.run(
                    [*command, topic, reliability, str(frames)],
                    env={**os.environ, **environment},
                    cwd=ROOT,
                    stdout=subprocess.PIPE,
                    text=True,
                    check=True,
                )
                row = json.loads(done.stdout.splitlines()[-1])
                median = row["median"][topic]
                late = "" if median is None else f", {1e3 * median:.1f} ms"
                print(
                    f"{transport:15} {reliability:12} {topic:12} {row['arrived'][topic]:3}{late},"
                    f" {row['share']:.2f} of a core",
                    flush=True,
                )


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1].split(","), sys.argv[2] == "reliable", int(sys.argv[3]))))
