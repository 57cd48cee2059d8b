"""What a camera that is listened to costs the contacts beside it.

Poses of 50 bodies come at 100 Hz; contacts are timed while a reader in a process of its own gets
colour, depth and labels of 640 x 480 pixels at 30 Hz, and while it does not, in turn. Run by
``python -m benchmarks.messages.beside_camera``; ``--read`` is that reader.
"""

from __future__ import annotations

import select
import subprocess
import sys
import time

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import Image, MultiDOFJointState

from benchmarks.messages.images import scene
from benchmarks.messages.processes import cpu_seconds, isolated
from msg_adapters.poses import multi_dof_joint_state_to_msg
from scene_graph_msgs.msg import ContactArray

__all__ = ["beside_camera"]

_BODIES, _RATE, _CAMERA_RATE = 50, 100.0, 30.0
_SHAKE = 0.01
"""Metres, standard deviation of the bodies' places."""
_SETTLE = 4.0
"""Seconds until a reader that was started gets images."""


def _moving_scene() -> str:
    """Return the scene of ``images`` with each body on a frame of its own."""
    frames = "".join(f"  - {{name: f{i}, source: cell}}\n" for i in range(_BODIES))
    text = scene().replace("frames: [{name: eye, source: cell}]\n", f"frames:\n{frames}")
    text = text.replace("frame: eye, ", "").replace("rate: 1000", f"rate: {_CAMERA_RATE}")
    for i in range(_BODIES):
        text = text.replace(
            f"{{name: b{i}, source: cell,", f"{{name: b{i}, source: cell, frame: f{i},"
        )
    return text


class _Contacts:
    """Sends poses and times the contacts that they lead to."""

    def __init__(self, domain: int) -> None:
        self._context = rclpy.Context()
        rclpy.init(
            context=self._context,
            domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self._node = rclpy.create_node("contacts", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._publisher = self._node.create_publisher(MultiDOFJointState, "/cell/poses", 10)
        self._node.create_subscription(
            ContactArray, "/scene_graph/contacts", self._take, 10, raw=True
        )
        self._rng = np.random.default_rng(1)
        self.arrived: dict[int, int] = {}

    def _take(self, data: bytes, info: dict[str, int]) -> None:
        seconds, nanoseconds = np.frombuffer(data, np.uint32, 2, 4).tolist()
        self.arrived.setdefault(10**9 * seconds + nanoseconds, info["received_timestamp"])

    def send(self) -> int:
        """Send new poses of all bodies; return their stamp."""
        X_WF = np.tile(np.eye(4), (_BODIES, 1, 1))
        X_WF[:, :3, 3] = self._rng.normal(scale=_SHAKE, size=(_BODIES, 3))
        names, stamp = [f"f{i}" for i in range(_BODIES)], time.time_ns()
        self._publisher.publish(
            multi_dof_joint_state_to_msg(names, X_WF, stamp_ns=stamp, frame_id="world")
        )
        return stamp

    def spin(self, seconds: float) -> None:
        """Handle what comes in for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def milliseconds(self, seconds: float) -> np.ndarray:
        """Send poses for a while; return how long each took to its contacts."""
        stamps, begin = [], time.monotonic()
        while time.monotonic() - begin < seconds:
            stamps.append(self.send())
            self.spin(max(begin + len(stamps) / _RATE - time.monotonic(), 0.0))
        self.spin(0.5)
        return np.array([1e-6 * (self.arrived[s] - s) for s in stamps if s in self.arrived])

    def close(self) -> None:
        """End the node."""
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


def beside_camera(is_quick: bool) -> list[tuple[float, float]]:
    """Print latencies without and with a reader of images; return the medians of each turn."""
    seconds, turns = (2.0, 1) if is_quick else (8.0, 3)
    medians = []
    with isolated() as place:
        node = place.start_node(_moving_scene())
        contacts = _Contacts(place.domain)
        while not contacts.arrived:
            place.check()
            contacts.send()
            contacts.spin(0.1)
        for _ in range(turns):
            turn = []
            for is_read in (False, True):
                if is_read:
                    reader = place.start(
                        "benchmarks.messages.beside_camera", "--read", stdin=subprocess.PIPE
                    )
                    contacts.spin(_SETTLE)
                cpu, begin = cpu_seconds(node.pid), time.monotonic()
                found = contacts.milliseconds(seconds)
                share = (cpu_seconds(node.pid) - cpu) / (time.monotonic() - begin)
                median, most, nearly_all = np.percentile(found, (50.0, 90.0, 99.0)).tolist()
                print(
                    f"{'with' if is_read else 'without'} images: {len(found)} contacts, median"
                    f" {median:.2f} ms, 90 % {most:.2f} ms, 99 % {nearly_all:.2f} ms,"
                    f" {share:.2f} of a core",
                    flush=True,
                )
                turn.append(median)
            reader.communicate()
            contacts.spin(1.0)
            medians.append((turn[0], turn[1]))
        contacts.close()
    return medians


def _read() -> None:
    """Take images until standard input ends."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("images")
    for kind in ("color", "depth", "label"):
        topic = f"/scene_graph/cameras/eye/{kind}/image"
        node.create_subscription(Image, topic, lambda data: None, 5, raw=True)
    while not select.select([sys.stdin], [], [], 0.0)[0]:
        rclpy.spin_once(node, timeout_sec=0.05)
    # In order: the node would send images to one that went without a word for twenty seconds.
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    _read() if "--read" in sys.argv else beside_camera(False)
