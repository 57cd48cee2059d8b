"""What a camera that is listened to costs the contacts beside it.

Poses of 50 bodies come at 100 Hz; contacts are timed while a reader in a process of its own gets
colour, depth and labels of 640 x 480 pixels at 30 Hz, and while it does not, in many short turns.
Run by ``python -m benchmarks.messages.beside_camera``; ``--read`` is that reader.
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
from rclpy.subscription import Subscription
from sensor_msgs.msg import Image, MultiDOFJointState

from benchmarks.messages.images import scene
from benchmarks.messages.processes import cpu_seconds, isolated, Isolation
from msg_adapters.poses import multi_dof_joint_state_to_msg
from scene_graph_msgs.msg import ContactArray

__all__ = ["beside_camera", "ratio"]

_BODIES, _RATE, _CAMERA_RATE = 50, 100.0, 30.0
_SHAKE = 0.01
"""Metres, standard deviation of the bodies' places."""
_PATIENCE = 60.0
"""Seconds until somebody has to have answered."""

_SETTLE = 0.5
"""Seconds after the first image, or the last."""


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
        """Send poses for a while; return how long each took to its contacts.

        Where a busy machine has answered none of them, they are sent for as long again.
        """
        end = time.monotonic() + _PATIENCE
        while True:
            stamps, begin = [], time.monotonic()
            while time.monotonic() - begin < seconds:
                stamps.append(self.send())
                self.spin(max(begin + len(stamps) / _RATE - time.monotonic(), 0.0))
            self.spin(0.5)
            found = [1e-6 * (self.arrived[s] - s) for s in stamps if s in self.arrived]
            if found or time.monotonic() > end:
                return np.array(found)

    def close(self) -> None:
        """End the node."""
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


class _Reader:
    """A reader of images in a process of its own, which takes them or does not."""

    def __init__(self, place: Isolation) -> None:
        self._process = place.start(
            "benchmarks.messages.beside_camera",
            "--read",
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def turn(self, word: str) -> None:
        """Take images ("on") or not ("off"); return when the first has come, or none is asked for.

        Raises RuntimeError where the reader has ended.
        """
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None
        assert stdout is not None
        stdin.write(f"{word}\n")
        stdin.flush()
        # The middleware may write lines of its own.
        if not any(line.strip() == word for line in stdout):
            raise RuntimeError("the reader of images has ended")

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def beside_camera(turns: int = 30, seconds: float = 2.0) -> list[tuple[float, float]]:
    """Print latencies without and with a reader of images, and their ratio.

    Return both medians (ms) of each turn, in which first one and then the other is measured, or
    the other way round, so that what else the machine does is the same for both.
    """
    medians = []
    found: dict[str, list[np.ndarray]] = {"off": [], "on": []}
    cores: dict[str, list[float]] = {"off": [], "on": []}
    with isolated() as place:
        node = place.start_node(_moving_scene())
        contacts, reader = _Contacts(place.domain), _Reader(place)
        while not contacts.arrived:
            place.check()
            contacts.send()
            contacts.spin(0.1)
        for k in range(turns):
            for word in ("off", "on") if k % 2 == 0 else ("on", "off"):
                reader.turn(word)
                contacts.milliseconds(_SETTLE)
                cpu, begin = cpu_seconds(node.pid), time.monotonic()
                found[word].append(contacts.milliseconds(seconds))
                cores[word].append((cpu_seconds(node.pid) - cpu) / (time.monotonic() - begin))
            without, beside = (float(np.median(found[word][-1])) for word in ("off", "on"))
            medians.append((without, beside))
        reader.close()
        contacts.close()
    for word, name in (("off", "without"), ("on", "with")):
        values = np.concatenate(found[word])
        median, most, nearly_all = np.percentile(values, (50.0, 90.0, 99.0)).tolist()
        print(
            f"{name} images: {len(values)} contacts, median {median:.2f} ms, 90 % {most:.2f} ms,"
            f" 99 % {nearly_all:.2f} ms, {np.mean(cores[word]):.2f} of a core"
        )
    print("median with images / without, over the turns: {:.2f} ({:.2f} to {:.2f})".format(
        *ratio(medians)
    ))  # fmt: skip
    return medians


def ratio(medians: list[tuple[float, float]]) -> tuple[float, float, float]:
    """Return the median over turns of with / without, and its interval of 95 % by resampling."""
    ratios = np.array([beside / without for without, beside in medians])
    drawn = np.random.default_rng(1).choice(ratios, (2000, len(ratios)))
    low, high = np.percentile(np.median(drawn, axis=1), (2.5, 97.5)).tolist()
    return float(np.median(ratios)), low, high


def _read() -> None:
    """Take images, or do not, as the lines of standard input say, until it ends."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("images")
    taken: list[Subscription] = []
    waiting = ""

    def take(data: bytes) -> None:
        nonlocal waiting
        if waiting:
            print(waiting, flush=True)
            waiting = ""

    while True:
        if select.select([sys.stdin], [], [], 0.0)[0]:
            word = sys.stdin.readline().strip()
            if not word:
                break
            while taken:
                node.destroy_subscription(taken.pop())
            if word == "on":
                waiting = word
                for kind in ("color", "depth", "label"):
                    topic = f"/scene_graph/cameras/eye/{kind}/image"
                    taken.append(node.create_subscription(Image, topic, take, 5, raw=True))
            else:
                print(word, flush=True)
        rclpy.spin_once(node, timeout_sec=0.05)
    # In order: the node would send images to one that went without a word for twenty seconds.
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    _read() if "--read" in sys.argv else beside_camera()
