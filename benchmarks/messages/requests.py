"""How long answers of services take while the world is updated at full rate."""

from __future__ import annotations

import os
import time

import numpy as np
import rclpy
from tqdm import tqdm

from benchmarks.messages.sustained import rig
from scene_graph_msgs.srv import ComputeSignedDistancePair, GetPoseInWorld, HasCollisions

__all__ = ["services"]

_RATE = 200.0
_WAIT_SECONDS = 30.0
_REQUESTS = (
    ("has_collisions", HasCollisions, HasCollisions.Request()),
    ("get_pose_in_world", GetPoseInWorld, GetPoseInWorld.Request(frames=["object_3"])),
    (
        "compute_signed_distance_pair",
        ComputeSignedDistancePair,
        ComputeSignedDistancePair.Request(geometries_a=["g1"], geometries_b=["g4"]),
    ),
)


def services(is_quick: bool) -> None:
    """Print the times from a request to its answer, at the client."""
    seconds = 2.0 if is_quick else 10.0
    print(f"milliseconds from request to answer while poses come at {_RATE:g} Hz")
    print(f"{'frames':>6} {'service':30} {'answers':>8} {'median':>7} {'99 %':>8} {'worst':>8}")
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    for frames in (100,) if is_quick else (100, 1000):
        with rig(frames, is_ordinary=False) as one:
            context = rclpy.Context()
            rclpy.init(context=context, domain_id=one.isolation.domain)
            node = rclpy.create_node("asks", context=context)
            executor = rclpy.executors.SingleThreadedExecutor(context=context)
            executor.add_node(node)
            for name, kind, request in tqdm(_REQUESTS, desc="services", leave=False):
                client = node.create_client(kind, f"/scene_graph/{name}")
                if not client.wait_for_service(_WAIT_SECONDS):
                    raise RuntimeError(f"no service {name}")
                one.sender.begin(_RATE, seconds)
                times, end = [], time.monotonic() + seconds
                while time.monotonic() < end:
                    begin = time.perf_counter()
                    future = client.call_async(request)
                    executor.spin_until_future_complete(future, _WAIT_SECONDS)
                    if not future.done() or future.result().status.code:
                        raise RuntimeError(f"{name} was not answered")
                    times.append((time.perf_counter() - begin) * 1e3)
                    # Requests at the pace of a planner, not a flood.
                    time.sleep(0.005)
                one.sender.end()
                median, high = np.percentile(times, (50, 99))
                print(
                    f"{frames:6} {name:30} {len(times):8} {median:7.2f} {high:8.2f}"
                    f" {max(times):8.2f}",
                    flush=True,
                )
            executor.shutdown()
            node.destroy_node()
            rclpy.shutdown(context=context)
