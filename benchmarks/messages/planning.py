"""How long answers take in the demo's cell: about a Panda's configurations, and what would be if.

    python -m benchmarks.messages planning

Joint states and poses of objects come at 200 Hz meanwhile, and contacts and markers are listened
to. The client is a process of its own: this module, run with ``--ask``. It asks again as soon as
it has an answer. The first row says how many updates there are while nobody asks.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import json
import subprocess
import sys
import time
from typing import Any

import numpy as np
from tqdm import tqdm

from benchmarks.messages.demo_cell import demo_cell

__all__ = ["planning"]

_RATE = 200.0
_CONFIGURATIONS, _EDGES = 1000, 100
_QUESTIONS = 8
_WHAT_IF, _NEAR = 100, 0.05
"""Places of a ball that are asked about at once; metres up to which distances are."""
_QUIET = 3.0
"""Seconds without a question."""
_LENGTH = 1.25
"""rad: edges are no longer."""

_JOINTS = [f"panda_joint{i}" for i in range(1, 8)]
_LIMITS = (2.8, 1.7, 2.8, 3.0, 2.8, 3.7, 2.8)
"""rad: within these, and their negatives, positions are random; joints 4 and 6 have one sign."""

_SEED = 5

_Job = tuple[str, Any, str, Callable[[], Any], Callable[[Any], float]]
"""What is asked in words, the service and its name, what makes a request, and what says how much
of the answer is free."""


def planning(is_quick: bool) -> None:
    """Print the times from a request to its answer, at the client."""
    count = 20 if is_quick else 300
    head = f"{'milliseconds from request to answer':36} {'median':>7} {'99 %':>7} {'worst':>7}"
    print(f"{head}  updates/s")
    with demo_cell(rate=_RATE) as (isolation, _, listener):
        before, begin = len(listener.arrivals), time.monotonic()
        time.sleep(_QUIET)
        rate = (len(listener.arrivals) - before) / (time.monotonic() - begin)
        print(f"{'nothing':36} {'':23} {rate:10.0f}", flush=True)
        child = isolation.start(
            *("benchmarks.messages.planning", "--ask", str(count)),
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in tqdm(range(_QUESTIONS), desc="planning", leave=False):
            before, begin = len(listener.arrivals), time.monotonic()
            answer = isolation.answer(child)
            rate = (len(listener.arrivals) - before) / (time.monotonic() - begin)
            values = np.array(answer["times"])
            median, high = np.percentile(values, (50, 99))
            figures = f"{median:7.2f} {high:7.2f} {values.max():7.2f} {rate:10.0f}"
            print(f"{answer['what']:36} {figures}  {answer['free']:.0%} free", flush=True)


def _what_if_jobs(rng: np.random.Generator) -> list[_Job]:
    """Return questions about a ball that might be elsewhere over the table."""
    from scene_graph_msgs.msg import QueryOptions, WhatIf
    from scene_graph_msgs.srv import ComputeSignedDistancePairwise, HasCollisions

    def somewhere(places: int) -> Any:
        poses = np.zeros((places, 7))
        poses[:, :3], poses[:, 6] = rng.uniform((0.3, -0.5, 0.46), (0.9, 0.5, 0.8), (places, 3)), 1
        what_if = WhatIf(frames=["objects/ball"], poses=poses.ravel().tolist())
        return QueryOptions(what_if=what_if, with_names=False)

    def collisions(places: int) -> Any:
        return HasCollisions.Request(options=somewhere(places))

    def distances() -> Any:
        options = somewhere(_WHAT_IF)
        return ComputeSignedDistancePairwise.Request(options=options, max_distance=[_NEAR])

    def free(response: Any) -> float:
        return 1.0 - float(np.mean(response.has_collisions))

    def apart(response: Any) -> float:
        return float((np.array(response.table.distance) > 0.0).mean())

    return [
        ("collisions if a ball were elsewhere", HasCollisions, "has_collisions",
         lambda: collisions(1), free),
        (f"the same, of {_WHAT_IF} places", HasCollisions, "has_collisions",
         lambda: collisions(_WHAT_IF), free),
        (f"distances up to {_NEAR} m of them", ComputeSignedDistancePairwise,
         "compute_signed_distance_pairwise", distances, apart),
    ]  # fmt: skip


def _ask(count: int) -> None:
    """Ask each service so often, and write what it took."""
    import rclpy

    from scene_graph_msgs.msg import RobotConfigurations
    from scene_graph_msgs.srv import CheckClearance, CheckConfigurations, CheckEdges

    rclpy.init()
    node = rclpy.create_node("planner")
    rng = np.random.default_rng(_SEED)

    def random_rows(rows: int) -> np.ndarray:
        q = rng.uniform(-1.0, 1.0, (rows, 7)) * _LIMITS
        q[:, 3], q[:, 5] = -np.abs(q[:, 3]), np.abs(q[:, 5])
        return q

    def configurations(with_collisions: bool) -> Any:
        rows = RobotConfigurations(names=_JOINTS)
        rows.positions = random_rows(_CONFIGURATIONS).ravel().tolist()
        return CheckConfigurations.Request(configurations=rows, with_collisions=with_collisions)

    def edges() -> Any:
        q = random_rows(2 * _EDGES).reshape(-1, 2, 7)
        ways = q[:, 1] - q[:, 0]
        lengths = np.linalg.norm(ways, axis=1)[:, np.newaxis]
        q[:, 1] = q[:, 0] + ways * np.minimum(1.0, _LENGTH / lengths)
        rows = RobotConfigurations(names=_JOINTS, positions=q.ravel().tolist())
        return CheckEdges.Request(ends=rows)

    def clearances(with_jacobians: bool) -> Any:
        rows = RobotConfigurations(names=_JOINTS)
        rows.positions = random_rows(_CONFIGURATIONS).ravel().tolist()
        return CheckClearance.Request(configurations=rows, with_jacobians=with_jacobians)

    def free_outcomes(response: Any) -> float:
        return float((np.array(response.outcomes) == response.FREE).mean())

    def kept_distances(response: Any) -> float:
        table = response.clearances
        near = np.array(table.row)[np.array(table.distance) <= 0.0]
        return 1.0 - len(np.unique(near)) / _CONFIGURATIONS

    jobs: list[_Job] = [
        (f"{_CONFIGURATIONS} configurations", CheckConfigurations, "check_configurations",
         lambda: configurations(with_collisions=False), free_outcomes),
        ("the same, with pairs and depths", CheckConfigurations, "check_configurations",
         lambda: configurations(with_collisions=True), free_outcomes),
        (f"{_EDGES} edges, proven", CheckEdges, "check_edges", edges, free_outcomes),
        (f"clearances of {_CONFIGURATIONS} up to 0.1 m", CheckClearance, "check_clearance",
         lambda: clearances(with_jacobians=False), kept_distances),
        ("the same, with Jacobians", CheckClearance, "check_clearance",
         lambda: clearances(with_jacobians=True), kept_distances),
    ]  # fmt: skip
    for what, kind, name, make, told in [*jobs, *_what_if_jobs(rng)]:
        client = node.create_client(kind, f"/scene_graph/{name}")
        client.wait_for_service()
        times, free = [], []
        while len(times) < count:
            request = make()
            begin = time.perf_counter()
            future = client.call_async(request)
            rclpy.spin_until_future_complete(node, future)
            elapsed = time.perf_counter() - begin
            response = future.result()
            if response.status.code == response.status.UNAVAILABLE:
                time.sleep(1.0)  # the kernels of planning are being compiled
                continue
            if response.status.code:
                raise RuntimeError(f"{name}: {response.status.message}")
            free.append(told(response))
            times.append(elapsed * 1e3)
        answer = {"what": what, "times": times[1:], "free": float(np.mean(free))}
        sys.stdout.write(json.dumps(answer) + "\n")
        sys.stdout.flush()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ask", type=int, required=True, help="how often")
    _ask(parser.parse_args().ask)
