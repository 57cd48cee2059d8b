"""What the demo sees: listens to the node's topics, asks its services, counts and sums up."""

from __future__ import annotations

from collections import defaultdict
import os
from pathlib import Path
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from tqdm import tqdm
from visualization_msgs.msg import Marker, MarkerArray

from common.camera_images import CameraListener
from common.names_of_geometry import path_of, paths_of
from scene_graph_msgs.msg import ContactArray
from scene_graph_msgs.srv import ComputeSignedDistancePairwise, DescribeScene, ListEffects

NODE = "/scene_graph"
CAMERA = f"{NODE}/cameras/wrist"
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CLOSEST_PAIRS = 5
SERVICE_SECONDS = 10.0


def cpu_seconds(pid: int) -> float:
    """Return the processor time that a process has used, from the kernel's accounting."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Monitor(Node):
    """Subscribes to contacts, markers and diagnostics of the node."""

    def __init__(self) -> None:
        rclpy.init()
        super().__init__("demo_monitor")
        self.latencies: list[float] = []
        """Seconds from a pose's stamp to when the middleware here had its contacts."""
        self.contact_counts: list[int] = []
        self.deepest: dict[tuple[str, str], float] = defaultdict(float)
        self.diagnostics: DiagnosticArray | None = None
        self.elapsed = 0.0
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)
        self.cpu_share = 0.0
        self._markers: dict[tuple[str, int], Marker] = {}
        self._best: tuple[list[Marker], ContactArray] | None = None
        self._is_watching = False
        self._has_contacts = False
        self.create_subscription(ContactArray, f"{NODE}/contacts", self._on_contacts, 10)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        topic = f"{NODE}/markers/illustration"
        self.create_subscription(MarkerArray, topic, self._on_markers, LATCHED)
        self.camera = CameraListener(self, CAMERA)

    def __enter__(self) -> Monitor:
        return self

    def __exit__(self, *exception: object) -> None:
        self._executor.shutdown()
        self.destroy_node()
        rclpy.try_shutdown()

    def _on_contacts(self, message: ContactArray, info: dict[str, int]) -> None:
        self._has_contacts = True
        if not self._is_watching:
            return
        stamp = message.header.stamp
        sent = 10**9 * stamp.sec + stamp.nanosec
        self.latencies.append(1e-9 * (info["received_timestamp"] - sent))
        self.contact_counts.append(len(message.points))
        for contact in message.points:
            pair = (path_of(contact.geometry_a), path_of(contact.geometry_b))
            self.deepest[pair] = max(self.deepest[pair], contact.depth)
        if self._markers and (
            self._best is None or len(message.points) > len(self._best[1].points)
        ):
            self._best = (list(self._markers.values()), message)

    def _on_markers(self, message: MarkerArray) -> None:
        for marker in message.markers:
            if marker.action == Marker.ADD:
                self._markers[marker.ns, marker.id] = marker
            else:
                self._markers.pop((marker.ns, marker.id), None)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.diagnostics = message

    def spin(self, seconds: float) -> None:
        """Handle what comes in for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def has_contacts(self) -> bool:
        """Say whether a contact message, full or empty, has come yet."""
        return self._has_contacts

    def page(self) -> str:
        """Return the file that opens the page with its token, "" while it is not known."""
        statuses = self.diagnostics.status if self.diagnostics is not None else ()
        return next(
            (
                value.value
                for status in statuses
                if status.name.endswith("effect: browser")
                for value in status.values
                if value.key == "opened with its token by"
            ),
            "",
        )

    def watch(self, seconds: float, node_pid: int) -> None:
        """Record what is published, with a progress bar."""
        start, cpu_start = time.monotonic(), cpu_seconds(node_pid)
        self._is_watching = True
        with tqdm(total=seconds, unit="s", bar_format="{l_bar}{bar}| {n:.0f} s{postfix}") as bar:
            for _ in range(max(1, round(seconds / 0.5))):
                self.spin(0.5)
                bar.update(0.5)
                if self.contact_counts:
                    bar.set_postfix_str(f"{self.contact_counts[-1]} contacts")
        self._is_watching = False
        self.elapsed = time.monotonic() - start
        self.cpu_share = (cpu_seconds(node_pid) - cpu_start) / self.elapsed

    def best_moment(self) -> tuple[list[Marker], ContactArray]:
        """Return the markers and contacts of the message with the most contacts."""
        if self._best is None:
            raise RuntimeError(f"no contact and marker messages came from {NODE}")
        return self._best

    def _call(self, service_type: type, name: str, request: Any) -> Any:
        client = self.create_client(service_type, f"{NODE}/{name}")
        if not client.wait_for_service(SERVICE_SECONDS):
            sys.exit(f"{client.srv_name}: no such service")
        future = client.call_async(request)
        self._executor.spin_until_future_complete(future, SERVICE_SECONDS)
        if not future.done():
            sys.exit(f"{client.srv_name}: no answer within {SERVICE_SECONDS:g} s")
        reply = future.result()
        if reply.status.code:
            sys.exit(f"{client.srv_name}: {reply.status.message}")
        return reply

    def ask(self) -> dict[str, Any]:
        """Ask the node what is in the scene, which pairs are closest and which effects are on."""
        pairwise = ComputeSignedDistancePairwise.Request(max_distance=[0.1])
        return {
            "scene": self._call(DescribeScene, "describe_scene", DescribeScene.Request()),
            "pairs": self._call(
                ComputeSignedDistancePairwise, "compute_signed_distance_pairwise", pairwise
            ).table,
            "effects": self._call(ListEffects, "list_effects", ListEffects.Request()).effects,
        }


def _closest_pairs(table: Any) -> list[str]:
    names = paths_of(table.geometries)
    distance = np.asarray(table.distance)
    apart = np.flatnonzero(distance > 0.0)
    nearest = apart[np.argsort(distance[apart], kind="stable")][:CLOSEST_PAIRS]
    return [
        f"    {1000 * distance[i]:7.2f} mm   {names[table.id_a[i]]} - {names[table.id_b[i]]}"
        for i in nearest
    ]


def summary(monitor: Monitor, answers: dict[str, Any]) -> str:
    """Return what happened, in words and figures."""
    scene = answers["scene"]
    latency = 1000.0 * np.array(monitor.latencies or [np.nan])
    median, p99 = np.percentile(latency, [50, 99])
    counts = monitor.contact_counts or [0]
    deepest = sorted(monitor.deepest.items(), key=lambda item: -item[1])
    on = [effect.name for effect in answers["effects"] if effect.is_on]
    off = [effect.name for effect in answers["effects"] if not effect.is_on]
    lines = [
        "",
        f"Scene      {len(scene.sources)} sources, {len(scene.frames)} frames, "
        f"{len(scene.geometries)} geometries",
        f"Updates    {len(counts) / monitor.elapsed:.0f} contact messages/s for "
        f"{monitor.elapsed:.1f} s; the node used {100 * monitor.cpu_share:.0f} % of one core",
        f"Latency    pose sent to contacts at this reader's middleware: median {median:.1f} ms,"
        f" 99 % {p99:.1f} ms",
        "Contacts   objects go in circles through what is near, as nothing holds them back;",
        f"           {len(deepest)} pairs touched, at most {max(counts)} at once; deepest:",
        *(f"    {1000 * depth:7.2f} mm   {a} - {b}" for (a, b), depth in deepest[:CLOSEST_PAIRS]),
        f"Camera     {monitor.camera.frames} times colour, depth and labels from {CAMERA}",
        "Closest    pairs that are apart at the end (within 0.1 m):",
        *_closest_pairs(answers["pairs"]),
        f"Effects    on: {', '.join(on) or 'none'}; off: {', '.join(off) or 'none'}",
    ]
    return "\n".join(lines)
