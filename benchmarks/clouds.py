"""What clouds cost beside other systems: ``python -m benchmarks.clouds``.

A Panda at a table with boxes and a shelf, which are points on their faces. Build, memory,
configurations in a batch and edges of 1.25 rad that begin at free ones are timed, and the same
without the cloud. Coal's octree of the same points is built and asked about, body by body, where
it is installed. Times are of the processor, the least of some calls.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import os
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import machine
from benchmarks.plans import panda
from scene_graph_ros.geometry import (
    Box,
    GeometryInstance,
    PointCloud,
    ProximityProperties,
    SceneGraph,
)
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.geometry.tables.point_tree import place_points
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.scene_files import register_robot

__all__ = [
    "BOXES",
    "checker_of",
    "coal_octree",
    "edges_from",
    "least",
    "main",
    "points_on_faces",
]

BOXES = (
    ((0.5, 0.0, -0.02), (0.8, 1.4, 0.04)),
    ((0.55, 0.35, 0.15), (0.15, 0.15, 0.3)),
    ((0.45, -0.4, 0.2), (0.2, 0.1, 0.4)),
    ((0.7, 0.0, 0.5), (0.3, 0.6, 0.02)),
    ((0.85, 0.0, 0.4), (0.02, 0.6, 0.8)),
    ((-0.5, 0.5, 0.4), (0.1, 0.1, 0.8)),
)
"""Centres and edges, m: of whose faces the points are."""
_RADIUS, _VOXEL, _LENGTH = 0.01, 0.02, 1.25
_CONFIGURATIONS, _EDGES, _REPEATS = 2000, 600, 5


def points_on_faces(count: int, seed: int = 0) -> NDArray[np.float64]:
    """Return points ``(count, 3)`` on the boxes' faces, even by area, in m."""
    rng = np.random.default_rng(seed)
    centers, sizes = (np.array(column) for column in zip(*BOXES, strict=True))
    areas = sizes[:, [1, 0, 0]] * sizes[:, [2, 2, 1]]
    box, axis = np.divmod(rng.choice(areas.size, count, p=areas.ravel() / areas.sum()), 3)
    place = rng.uniform(-0.5, 0.5, (count, 3))
    place[np.arange(count), axis] = rng.choice([-0.5, 0.5], count)
    result: NDArray[np.float64] = centers[box] + place * sizes[box]
    return result


def checker_of(
    points: NDArray[np.float64] | None,
    radius: float = _RADIUS,
    *,
    boxes: bool = False,
    more: Sequence[GeometryInstance] = (),
) -> SceneGraphCollisionChecker:
    """Return the checker of a Panda in a cloud, among the boxes themselves, or with ``more``."""
    model, semantics = panda()
    graph = SceneGraph()
    source = graph.register_source("panda")
    frames = register_robot(model, graph, source, semantics=semantics, visual=False)
    cell = graph.register_source("cell")
    for row, (center, size) in enumerate(BOXES if boxes else ()):
        box = GeometryInstance(pose_from_xyz_rpy(center), Box(*size), f"box_{row}")
        box.set_proximity_properties(ProximityProperties())
        graph.register_anchored_geometry(cell, box)
    for instance in more:
        graph.register_anchored_geometry(cell, instance)
    if points is not None:
        camera = graph.register_source("camera")
        instance = GeometryInstance(np.eye(4), PointCloud(points, radius), "seen")
        instance.set_proximity_properties(ProximityProperties())
        graph.register_anchored_geometry(camera, instance)
    context = graph.create_default_context()
    tree = model.kinematic_tree(semantics)
    return SceneGraphCollisionChecker(RobotDiagram(graph, context, tree, frames))


def least(ask: Callable[[], Any], repeats: int = _REPEATS) -> float:
    """Return the least time of some calls, s, after one that is not counted."""
    ask()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        ask()
        times.append(time.process_time() - begin)
    return min(times)


def _queries(checker: SceneGraphCollisionChecker) -> tuple[NDArray[np.float64], ...]:
    tree = checker.plan.tree
    q = tree.sample(np.random.default_rng(1), _CONFIGURATIONS)
    return q, edges_from(tree, q[checker.check_configs_collision_free(q)][:_EDGES])


def edges_from(tree: Any, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return edges ``(n, 2, nq)`` of 1.25 rad that begin at configurations."""
    way = np.random.default_rng(2).normal(size=q.shape)
    way *= _LENGTH / np.linalg.norm(way, axis=1)[:, np.newaxis]
    return np.stack([q, np.clip(q + way, tree.lower, tree.upper)], axis=1)


def _ours(count: int) -> str:
    points, radius = points_on_faces(count), np.array(_RADIUS)
    build = least(lambda: place_points(points, radius))
    size = sum(array.nbytes for array in place_points(points, radius).tree)
    checker = checker_of(points)
    q, edges = _queries(checker)
    free, proven = (
        checker.check_configs_collision_free(q),
        checker.check_edges_collision_free(edges),
    )
    one = least(lambda: checker.check_configs_collision_free(q)) / len(q)
    edge = least(lambda: checker.check_edges_collision_free(edges)) / len(edges)
    return (
        f"| {count} | {1e3 * build:.2f} | {1e-6 * size:.1f} | {1e6 * one:.2f} | {1e6 * edge:.1f} |"
        f" {free.mean():.2f}, {proven.mean():.2f} |"
    )


def _without() -> str:
    checker = checker_of(None)
    q, edges = _queries(checker)
    one = least(lambda: checker.check_configs_collision_free(q)) / len(q)
    edge = least(lambda: checker.check_edges_collision_free(edges)) / len(edges)
    return f"| none | | | {1e6 * one:.2f} | {1e6 * edge:.1f} | |"


def coal_octree(
    points: NDArray[np.float64], voxel: float, q: NDArray[np.float64]
) -> tuple[float, float]:
    """Return us of a configuration beside Coal's octree of points, and ms to build that.

    They are NaN where Coal is not installed.
    """
    try:
        import coal
    except ImportError:
        return float("nan"), float("nan")
    build = least(lambda: coal.makeOctree(points, voxel), 1)
    octree, checker = coal.makeOctree(points, voxel), checker_of(None)
    plan, inspector = checker.plan, checker.snapshot.inspector
    bodies = []
    for body in range(len(plan.carried)):
        hull = inspector.get_convex_hull(plan.geometry_ids[body])
        lower, upper = plan.bodies.lower[body], plan.bodies.upper[body]
        shape: Any = coal.Box(*(upper - lower))
        shift = 0.5 * (lower + upper)
        if hull is not None:
            vertices = coal.StdVec_Vec3s()
            vertices.extend(list(hull.vertices))
            shape, shift = coal.Convex.convexHull(vertices, False, "Qt"), np.zeros(3)
        bodies.append((shape, shift))
    request, still = coal.CollisionRequest(), coal.Transform3s()
    X_WL = np.array([plan.tree.link_poses(each) for each in q])
    X_WG = X_WL[:, plan.owners[: len(bodies)]] @ plan.X_LG

    def ask() -> int:
        hits = 0
        for poses in X_WG:
            for (shape, shift), X in zip(bodies, poses, strict=True):
                result = coal.CollisionResult()
                at = coal.Transform3s(X[:3, :3], X[:3, :3] @ shift + X[:3, 3])
                if coal.collide(shape, at, octree, still, request, result):
                    hits += 1
                    break
        return hits

    return 1e6 * least(ask, 1) / len(q), 1e3 * build


def _coal(count: int) -> str:
    q = _queries(checker_of(None))[0][:200]
    time_us, build_ms = coal_octree(points_on_faces(count), _VOXEL, q)
    if np.isnan(time_us):
        return "Coal is not installed: `make peers` installs it."
    return (
        f"Coal's octree of {100 * _VOXEL:.0f} cm, {count} points: built in {build_ms:.0f} ms, a"
        f" configuration {time_us:.0f} us, asked from Python body by body."
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--counts", type=int, nargs="+", default=(1000, 10_000, 100_000, 1_000_000)
    )
    chosen = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    print("| points | build ms | MB | configuration us | edge us | free, proven |")
    print("| ---: | ---: | ---: | ---: | ---: | ---: |")
    print(_without())
    for count in chosen.counts:
        print(_ours(count), flush=True)
    print(f"\n{_coal(max(n for n in chosen.counts if n <= 100_000))}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
