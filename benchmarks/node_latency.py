"""The node under load: its share of a core, and the time from a pose's arrival to its contacts.

    python -m benchmarks.node_latency --seconds 15

A Panda moves by JointState and free objects by MultiDOFJointState, from a process of their own;
the node is another process; this one listens to contacts and diagnostics. Two latencies are
printed: inside the node (arrival of the bytes to the hand-over of the contact message), and end
to end (the sender's stamp to the receipt of the contacts of that stamp, both transports included).
"""

from __future__ import annotations

import argparse
import math
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import domain_coordinator
from geometry_msgs.msg import Quaternion, Transform, Vector3
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import JointState, MultiDOFJointState

from scene_graph_msgs.msg import ContactArray

ROOT = Path(__file__).parents[1]
ROBOT = "package://example-robot-data/robots/panda_description"
JOINTS = [*(f"panda_joint{i}" for i in range(1, 8)), "panda_finger_joint1", "panda_finger_joint2"]
SHAPES = (
    "{type: sphere, radius: 0.04}",
    "{type: box, size: [0.08, 0.06, 0.05]}",
    "{type: capsule, radius: 0.03, length: 0.06}",
    "{type: cylinder, radius: 0.03, length: 0.08}",
    "{type: ellipsoid, semi_axes: [0.05, 0.03, 0.04]}",
)


def start_position(index: int, count: int) -> tuple[float, float, float]:
    """Return where an object starts: on a spiral around the robot, some within its reach."""
    angle = 2.399963 * index  # the golden angle spreads them evenly
    radius = 0.2 + 0.3 * math.sqrt((index + 0.5) / count)
    return radius * math.cos(angle), radius * math.sin(angle), 0.03 + 0.05 * ((index * 7) % 10)


def scene(count: int) -> str:
    """Return the scene: a Panda on a floor, a table, and free objects."""
    lines = [
        "version: 1",
        "sources: [{name: cell}, {name: objects}]",
        f"robots: [{{name: panda, urdf: '{ROBOT}/urdf/panda.urdf',",
        f"    srdf: '{ROBOT}/srdf/panda.srdf', group_state: default}}]",
        "frames:",
    ]
    for i in range(count):
        x, y, z = start_position(i, count)
        lines.append(
            f"  - {{name: o{i}, source: objects, pose: {{xyz: [{x:.6f}, {y:.6f}, {z:.6f}]}}}}"
        )
    lines += [
        "geometries:",
        "  - {name: floor, source: cell, shape: {type: half_space},"
        " pose: {xyz: [0.0, 0.0, -0.01]}}",
        "  - {name: table, source: cell, shape: {type: box, size: [0.4, 0.8, 0.1]},"
        " pose: {xyz: [0.6, 0.0, 0.05]}}",
    ]
    for i in range(count):
        lines.append(
            f"  - {{name: g{i}, source: objects, frame: o{i}, shape: {SHAPES[i % len(SHAPES)]}}}"
        )
    return "\n".join(lines) + "\n"


def publish(count: int, rate: float) -> None:
    """Send joint positions and object poses at ``rate`` (Hz) until the process is ended."""
    rclpy.init()
    node = rclpy.create_node("load")
    joints = node.create_publisher(JointState, "joint_states", 10)
    poses = node.create_publisher(MultiDOFJointState, "objects/poses", 10)
    starts = [start_position(i, count) for i in range(count)]
    state = JointState(name=JOINTS)
    moving = MultiDOFJointState(joint_names=[f"o{i}" for i in range(count)])
    moving.transforms = [Transform(rotation=Quaternion(w=1.0)) for _ in range(count)]

    def send() -> None:
        t = time.monotonic()
        swing = [0.3 * math.sin(0.7 * t + i) for i in range(7)]
        home = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
        state.position = [h + s for h, s in zip(home, swing, strict=True)] + [0.02, 0.02]
        state.header.stamp = node.get_clock().now().to_msg()
        joints.publish(state)
        for i, (x, y, z) in enumerate(starts):
            moving.transforms[i].translation = Vector3(
                x=x + 0.05 * math.cos(t + i), y=y + 0.05 * math.sin(t + i), z=z
            )
        moving.header.stamp = node.get_clock().now().to_msg()
        poses.publish(moving)

    node.create_timer(1.0 / rate, send)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        return


def cpu_seconds(pid: int) -> float:
    """Return the processor time that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Listener:
    """Takes contacts and diagnostics."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("listener")
        self.latencies: list[float] = []
        self.contacts: list[int] = []
        self.diagnostics: dict[str, dict[str, str]] = {}
        self._stamp = (0, 0)
        self.node.create_subscription(ContactArray, "/scene_graph/contacts", self._contacts, 10)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._diagnostics, 10)

    def _contacts(self, message: ContactArray) -> None:
        stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
        if stamp != self._stamp and stamp != (0, 0):
            self._stamp = stamp
            sent = stamp[0] * 10**9 + stamp[1]
            self.latencies.append((self.node.get_clock().now().nanoseconds - sent) * 1e-9)
            self.contacts.append(len(message.points))

    def _diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.diagnostics[status.name] = {v.key: v.value for v in status.values}

    def spin(self, seconds: float) -> None:
        """Take messages for some seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.1)


def measure(count: int, rate: float, seconds: float, executor: str) -> dict[str, Any]:
    """Run node and load for ``seconds`` after a warm-up and return what was measured."""
    children: list[subprocess.Popen[bytes]] = []
    with tempfile.TemporaryDirectory() as folder, domain_coordinator.domain_id() as domain:
        path = Path(folder) / "scene.yaml"
        path.write_text(scene(count))
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        node = [sys.executable, "-m", "scene_graph_ros.node", "--ros-args"]
        node += ["-p", f"scene:={path}", "-p", f"executor:={executor}"]
        load = [sys.executable, "-m", "benchmarks.node_latency", "--publish"]
        load += ["--objects", str(count), "--rate", str(rate)]
        rclpy.init(domain_id=domain)
        try:
            children += [
                subprocess.Popen(command, env=environment, cwd=ROOT, stderr=subprocess.DEVNULL)
                for command in (node, load)
            ]
            listener = Listener()
            begin = time.monotonic()
            while len(listener.contacts) < rate:
                listener.spin(0.5)
                if time.monotonic() - begin > 120.0:
                    raise TimeoutError("no contacts from the node within two minutes")
            listener.latencies.clear()
            listener.contacts.clear()
            used, begin = cpu_seconds(children[0].pid), time.monotonic()
            listener.spin(seconds)
            elapsed = time.monotonic() - begin
            share = (cpu_seconds(children[0].pid) - used) / elapsed
        finally:
            for child in children:
                child.terminate()
            for child in children:
                child.wait(timeout=30)
            rclpy.shutdown()
    return {"listener": listener, "share": share, "elapsed": elapsed}


def report(result: dict[str, Any], executor: str) -> None:
    """Print the table."""
    listener = result["listener"]
    world = listener.diagnostics.get("scene_graph: world", {})
    latencies = np.array(listener.latencies) * 1e3
    contacts = np.array(listener.contacts)
    inside = [float(world[f"latency {key} (s)"]) * 1e3 for key in ("median", "99th percentile")]
    print(f"executor                          {executor}")
    print(f"node's share of one core          {result['share']:.2f}")
    print(f"contact messages                  {len(contacts) / result['elapsed']:.0f} per second")
    print(f"contacts in a message             {contacts.min()} to {contacts.max()}")
    print(f"arrival to contacts, in the node  {inside[0]:.2f} ms median, {inside[1]:.2f} ms p99")
    median, high = np.percentile(latencies, (50, 99))
    print(f"stamp to receipt, end to end      {median:.2f} ms median, {high:.2f} ms p99")
    for name, values in sorted(listener.diagnostics.items()):
        if ": source " in name:
            print(
                f"{name.split(': ')[1]:33} {float(values['rate (Hz)']):.0f} messages/s, "
                f"{values['messages superseded']} superseded, {values['dropped']} dropped"
            )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--objects", type=int, default=50)
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--executor", default="multi_threaded")
    parser.add_argument("--publish", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.publish:
        publish(options.objects, options.rate)
        return
    result = measure(options.objects, options.rate, options.seconds, options.executor)
    report(result, options.executor)


if __name__ == "__main__":
    main()
