"""Asks services of the node in turn and notes how long each answer takes.

Reads lines ``{"seconds": s}`` and answers each with ``{"service": [milliseconds, ...], ...}``. It
waits for nothing but the answer, so that the time is the node's and the middleware's.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import Any

import numpy as np
import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions

from benchmarks.messages.empty_service import EMPTY, NAME
from scene_graph_msgs.srv import (
    ComputePointPairPenetration,
    ComputeSignedDistancePair,
    ComputeSignedDistanceToPoint,
    GetPoseInWorld,
    HasCollisions,
)

_WAIT_SECONDS = 30.0
_PAUSES = (0.002, 0.008)
"""Seconds between an answer and the next request: the pace of a planner, at no fixed phase."""

_SEED = 21


def requests(options: argparse.Namespace) -> list[tuple[str, Any, Any]]:
    """Return name, type and request of each service that is asked, the empty one at last."""
    pair = ComputeSignedDistancePair.Request(
        geometries_a=[options.pair[0]], geometries_b=[options.pair[1]]
    )
    point = ComputeSignedDistanceToPoint.Request(points=[0.5, 0.0, 0.5], threshold=[0.5])
    return [
        ("has_collisions", HasCollisions, HasCollisions.Request()),
        ("compute_signed_distance_pair", ComputeSignedDistancePair, pair),
        ("compute_signed_distance_to_point", ComputeSignedDistanceToPoint, point),
        ("get_pose_in_world", GetPoseInWorld, GetPoseInWorld.Request(frames=[options.frame])),
        (
            "compute_point_pair_penetration",
            ComputePointPairPenetration,
            ComputePointPairPenetration.Request(),
        ),
        (EMPTY, HasCollisions, HasCollisions.Request()),
    ]


class _Caller:
    """Calls one service."""

    def __init__(self, node: Any, name: str, kind: Any, request: Any) -> None:
        self.name, self._kind, self._request = name, kind, request
        topic = NAME if name == EMPTY else f"/scene_graph/{name}"
        self._client = node.create_client(kind, topic)
        if not self._client.wait_for_service(_WAIT_SECONDS):
            raise RuntimeError(f"no service {name}")
        context = node.context.handle
        self._wait_set = rclpy_implementation.WaitSet(0, 0, 0, 1, 0, 0, context)

    def call(self) -> float:
        """Return how many milliseconds an answer takes."""
        handle = self._client.handle
        begin = time.perf_counter()
        handle.send_request(self._request)
        self._wait_set.clear_entities()
        self._wait_set.add_client(handle)
        self._wait_set.wait(int(_WAIT_SECONDS * 1e9))
        _, response = handle.take_response(self._kind.Response)
        elapsed = time.perf_counter() - begin
        if response is None or response.status.code:
            raise RuntimeError(f"{self.name}: {response}")
        return elapsed * 1e3


def main() -> None:
    """Ask as standard input says, until it ends."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.messages.asker", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--pair", nargs=2, required=True, help="two geometries")
    parser.add_argument("--frame", required=True)
    options = parser.parse_args()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("asker")
    callers = [_Caller(node, *one) for one in requests(options)]
    rng = np.random.default_rng(_SEED)
    for line in sys.stdin:
        end = time.monotonic() + json.loads(line)["seconds"]
        times: dict[str, list[float]] = {caller.name: [] for caller in callers}
        while time.monotonic() < end:
            for caller in callers:
                time.sleep(rng.uniform(*_PAUSES))
                times[caller.name].append(caller.call())
        sys.stdout.write(json.dumps(times) + "\n")
        sys.stdout.flush()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(0)
