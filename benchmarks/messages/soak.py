"""Memory of the node over a long run at full rate, and what a geometry costs.

    python -m benchmarks.messages.soak --seconds 600

Poses of all frames come at full rate, contacts and markers are listened to, a client asks
questions, and geometry comes and goes. Memory is that of the whole process.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
import threading
import time
from typing import Any

from geometry_msgs.msg import Pose, Quaternion
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from tqdm import tqdm

from benchmarks.messages.processes import resident_bytes
from benchmarks.messages.sustained import Rig, rig
from scene_graph_msgs.msg import GeometryDescription, GeometryReference, RoleProperties, Shape
from scene_graph_msgs.srv import (
    ComputeSignedDistancePairwise,
    HasCollisions,
    RegisterAnchoredGeometry,
    RegisterSource,
    RemoveGeometry,
)

__all__ = ["Soaked", "soak"]

_ANSWER_SECONDS = 60.0
_MEGABYTE = 1e6
_SETTLING = 0.25
"""Part of the run after which memory counts: pools and caches have filled by then."""


class _Client:
    """Asks the node's services, one request at a time."""

    def __init__(self, one: Rig) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=one.isolation.domain)
        self.node = rclpy.create_node("soak", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._clients: dict[str, Any] = {}
        self.answers = 0

    def call(self, kind: Any, service: str, /, **fields: Any) -> Any:
        """Return the response; raise RuntimeError for one that is not good."""
        client = self._clients.get(service)
        if client is None:
            client = self._clients[service] = self.node.create_client(
                kind, f"/scene_graph/{service}"
            )
            client.wait_for_service(_ANSWER_SECONDS)
        future = client.call_async(kind.Request(**fields))
        self.executor.spin_until_future_complete(future, _ANSWER_SECONDS)
        if not future.done() or future.result().status.code:
            raise RuntimeError(f"{service}: {future.result() if future.done() else 'no answer'}")
        self.answers += 1
        return future.result()

    def close(self) -> None:
        """End it."""
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@dataclass(frozen=True)
class Soaked:
    """What a run showed; memory in bytes."""

    seconds: float
    times: np.ndarray
    memory: np.ndarray
    sent: int
    answered: int
    requests: int
    per_geometry: float

    def _settled(self) -> np.ndarray:
        return self.times >= _SETTLING * self.seconds

    @property
    def growth(self) -> float:
        """How much more the last quarter took than the second, bytes."""
        second = (self.times >= _SETTLING * self.seconds) & (self.times < 0.5 * self.seconds)
        last = self.times >= 0.75 * self.seconds
        return float(np.median(self.memory[last]) - np.median(self.memory[second]))

    @property
    def slope(self) -> float:
        """Bytes per second of the line through all that was measured after settling."""
        settled = self._settled()
        return float(np.polyfit(self.times[settled], self.memory[settled], 1)[0])


def _geometry(index: int) -> GeometryDescription:
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x, pose.position.z = 100.0 + index, 100.0
    return GeometryDescription(
        name=f"extra_{index}",
        shape=Shape(kind=Shape.SPHERE, dimensions=[0.1]),
        pose=pose,
        roles=[
            RoleProperties(role=role)
            for role in (RoleProperties.PROXIMITY, RoleProperties.ILLUSTRATION)
        ],
    )


def _names(count: int) -> list[GeometryReference]:
    return [GeometryReference(name=f"extra_{i}") for i in range(count)]


def _ask(client: _Client, source: Any, stop: threading.Event) -> None:
    """Ask and change things until told to stop."""
    while not stop.is_set():
        client.call(HasCollisions, "has_collisions")
        client.call(
            ComputeSignedDistancePairwise, "compute_signed_distance_pairwise", max_distance=[0.05]
        )
        extra = [_geometry(i) for i in range(3)]
        client.call(
            RegisterAnchoredGeometry,
            "register_anchored_geometry",
            source=source,
            geometries=extra,
        )
        client.call(RemoveGeometry, "remove_geometry", source=source, geometries=_names(3))
        stop.wait(1.0)


def _cost(one: Rig, client: _Client, source: Any, count: int) -> float:
    """Return how many bytes the process grows by for each geometry."""
    before = resident_bytes(one.node.pid)
    extra = [_geometry(i) for i in range(count)]
    client.call(
        RegisterAnchoredGeometry, "register_anchored_geometry", source=source, geometries=extra
    )
    one.run(50.0, 2.0)
    cost = (resident_bytes(one.node.pid) - before) / count
    client.call(RemoveGeometry, "remove_geometry", source=source, geometries=_names(count))
    return cost


def soak(
    seconds: float,
    *,
    frames: int = 1000,
    rate: float = 200.0,
    geometries: int = 2000,
    progress: Callable[[float], None] = lambda done: None,
) -> Soaked:
    """Run everything for a while and return what it did to the node's memory."""
    times, memory = [], []
    with rig(frames, is_ordinary=False) as one:
        client = _Client(one)
        stop = threading.Event()
        try:
            source = client.call(RegisterSource, "register_source", name="soak").source
            asking = threading.Thread(target=_ask, args=(client, source, stop))
            asking.start()
            begin = time.monotonic()
            one.listener.arrivals.clear()
            one.sender.begin(rate, seconds)
            while (now := time.monotonic() - begin) < seconds:
                one.isolation.check()
                times.append(now)
                memory.append(resident_bytes(one.node.pid))
                progress(now)
                time.sleep(min(1.0, seconds / 60.0))
            sent = one.sender.end()
            answered = len({stamp for stamp, _ in list(one.listener.arrivals)})
            stop.set()
            asking.join()
            cost = _cost(one, client, source, geometries)
        finally:
            stop.set()
            client.close()
    return Soaked(seconds, np.array(times), np.array(memory), sent, answered, client.answers, cost)


def main() -> None:
    """Soak and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.messages.soak",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--rate", type=float, default=200.0)
    options = parser.parse_args()
    with tqdm(total=options.seconds, unit="s", bar_format="{l_bar}{bar}| {n:.0f} s") as bar:
        result = soak(
            options.seconds,
            frames=options.frames,
            rate=options.rate,
            progress=lambda now: bar.update(now - bar.n),
        )
    memory = result.memory / _MEGABYTE
    print(f"{options.frames} frames at {options.rate:g} Hz for {options.seconds:g} s")
    print(f"{result.sent} pose messages, {result.answered} with contacts of their own,")
    print(f"{result.requests} requests answered, half of them changing the scene")
    print(
        f"memory {memory[0]:.1f} MB at first, {memory[-1]:.1f} MB at last, {memory.max():.1f} most"
    )
    print(f"growth from the second quarter to the last {result.growth / _MEGABYTE:+.2f} MB,")
    print(f"slope after settling {result.slope * 3600.0 / _MEGABYTE:+.1f} MB per hour")
    print(f"{result.per_geometry / 1000.0:.1f} kB per geometry with two roles")


if __name__ == "__main__":
    main()
