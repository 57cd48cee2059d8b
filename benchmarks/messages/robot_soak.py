"""A robot on a bad network for long, with all poses compared at each update.

    python -m benchmarks.messages.robot_soak --seconds 600

`bad_network` moves a robot of five drivers over DDS. The node runs in this process, so that each
of its updates can be looked at: of all messages that its readers have taken by then, the newest of
each joint says where each link has to be, by formulas of this file. The stamps must be these, too.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import contextlib
import math
import subprocess
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from benchmarks.messages.bad_network import BASE_TOPIC, DRIVERS
from benchmarks.messages.processes import isolated, Isolation
from msg_adapters.stamps import stamp_from_msg
from scene_graph_ros.node.node import SceneGraphNode
from scene_graph_ros.node.world.queued_channel import QueuedChannel
from scene_graph_ros.node.world.world import World

__all__ = ["SoakResult", "soak_robot"]

_BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
_LIMIT = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
_MIMIC = '<mimic joint="grip_j" multiplier="-1"/>'


def _joint(name: str, kind: str, parent: str, child: str, more: str = "") -> str:
    return (
        f'<link name="{child}">{_BALL}</link><joint name="{name}" type="{kind}">'
        f'<parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>{more}</joint>'
    )


_URDF = f"""<robot name="r"><link name="base">{_BALL}</link>
{_joint("arm_j", "revolute", "base", "arm", _LIMIT)}
{_joint("grip_j", "prismatic", "arm", "grip", '<origin xyz="1 0 0"/>' + _LIMIT)}
{_joint("other_j", "prismatic", "arm", "other", _MIMIC + _LIMIT)}
{_joint("sled_j", "planar", "base", "sled", '<origin xyz="0 2 0"/>')}
</robot>"""
_SCENE = f"""version: 1
robots:
  - {{name: r, urdf: robot.urdf, filter_adjacent: true, base: {{topic: {BASE_TOPIC}}}}}
"""


class SoakResult(NamedTuple):
    """What was sent and compared."""

    sent: int
    received: int
    updates: int
    """Snapshots of the world with poses that were compared."""
    largest_error: float
    """m: of any link in any update."""
    wrong_stamps: int
    out_of_order: int
    """Positions that were older than what they would have replaced."""


class _Reference:
    """What messages say that were taken by now, and how far the world is from that."""

    def __init__(self) -> None:
        self._newest = {name: (-1, 0.0) for driver in DRIVERS for name in driver.names}
        self.received = self.updates = self.wrong_stamps = self.out_of_order = 0
        self.error = 0.0

    def take(self, channel: QueuedChannel, data: bytes) -> None:
        """Note what a message says."""
        message = deserialize_message(data, channel.kind)
        self.received += 1
        stamp = stamp_from_msg(message.header.stamp)
        if isinstance(message, JointState):
            said = list(zip(message.name, message.position, strict=True))
        elif hasattr(message, "pose"):
            said = [("base", message.pose.pose.position.x)]
        else:
            said = [(message.joint_names[0], message.transforms[0].translation.x)]
        for name, value in said:
            if stamp >= self._newest[name][0]:
                self._newest[name] = stamp, value
            else:
                self.out_of_order += 1

    def compare(self, world: World) -> None:
        """Compare all links of a snapshot."""
        if min(stamp for stamp, _ in self._newest.values()) < 0:
            return
        self.updates += 1
        snapshot = world.snapshot
        (base, arm, grip, sled) = (
            self._newest[name][1] for name in ("base", "arm_j", "grip_j", "sled_j")
        )
        X_WB = _at(base, 0.0, 0.0, base)
        expected = {
            "base": X_WB,
            "arm": X_WB @ _at(0.0, 0.0, 0.0, arm),
            "grip": X_WB @ _at(0.0, 0.0, 0.0, arm) @ _at(1.0, 0.0, grip),
            "other": X_WB @ _at(0.0, 0.0, 0.0, arm) @ _at(0.0, 0.0, -grip),
            "sled": X_WB @ _at(sled, 2.0, 0.0, sled),
        }
        for link, X in expected.items():
            found = snapshot.query.get_pose_in_world(snapshot.names.frame_id(f"r/{link}"))
            self.error = max(self.error, float(np.abs(found - X).max()))
        oldest = min(stamp for stamp, _ in self._newest.values())
        self.wrong_stamps += snapshot.source_stamp("r") != oldest


def _at(x: float, y: float, z: float, angle: float = 0.0) -> NDArray[np.float64]:
    """Return a pose that is turned about z."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])


@contextlib.contextmanager
def _tapped(reference: _Reference) -> Iterator[None]:
    """Have the reference take each message that a reader of the node takes."""
    store = QueuedChannel.store

    def tapped(self: QueuedChannel, data: bytes, arrival: int, *, is_static: bool = False) -> None:
        reference.take(self, data)
        store(self, data, arrival, is_static=is_static)

    QueuedChannel.store = tapped  # type: ignore[method-assign]
    try:
        yield
    finally:
        QueuedChannel.store = store  # type: ignore[method-assign]


@contextlib.contextmanager
def _node(isolation: Isolation) -> Iterator[SceneGraphNode]:
    """Run the node in a thread of this process."""
    (isolation.folder / "robot.urdf").write_text(_URDF)
    scene = isolation.folder / "scene.yaml"
    scene.write_text(_SCENE)
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=isolation.domain)
    node = SceneGraphNode(
        context=context,
        parameter_overrides=[
            Parameter("scene", value=str(scene)),
            Parameter("max_pose_age", value=0.0),
        ],
    )
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with contextlib.suppress(ExternalShutdownException):
            executor.spin()

    spinning = threading.Thread(target=spin)
    spinning.start()
    try:
        yield node
    finally:
        rclpy.shutdown(context=context)
        spinning.join()
        node.destroy_node()


def soak_robot(
    rounds: int,
    *,
    rate: float = 50.0,
    seed: int = 0,
    progress: Callable[[int], None] = lambda updates: None,
) -> SoakResult:
    """Send so many rounds of messages at a rate (Hz); return what all updates showed."""
    reference, heard = _Reference(), threading.Condition()
    with isolated() as isolation, _tapped(reference), _node(isolation) as node:
        world = node.server.world

        def compare() -> None:
            with heard:
                reference.compare(world)
                heard.notify_all()

        world.watch(compare)
        arguments = ("--rounds", str(rounds), "--rate", str(rate), "--seed", str(seed))
        drivers = isolation.start(
            "benchmarks.messages.bad_network",
            *arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        answers: list[dict[str, Any]] = []
        reader = threading.Thread(target=lambda: answers.append(isolation.answer(drivers)))
        reader.start()
        while reader.is_alive():
            reader.join(1.0)
            progress(reference.updates)
        sent = int(answers[0]["sent"])
        with heard:
            # All, unless so many came at once that readers dropped some.
            heard.wait_for(lambda: reference.received >= sent, 2.0)
        isolation.ask(drivers)
        drivers.wait(20.0)
        world.unwatch(compare)
    return SoakResult(
        sent,
        reference.received,
        reference.updates,
        reference.error,
        reference.wrong_stamps,
        reference.out_of_order,
    )


def main() -> None:
    """Soak for the time that the arguments say, and print the figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.messages.robot_soak")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rate", type=float, default=50.0)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rounds = round(arguments.seconds * arguments.rate)
    result = soak_robot(
        rounds,
        rate=arguments.rate,
        seed=arguments.seed,
        progress=lambda updates: print(f"\r{updates} updates", end="", flush=True),
    )
    print()
    for name, value in result._asdict().items():
        print(f"{name.replace('_', ' ')}: {value}")


if __name__ == "__main__":
    main()
