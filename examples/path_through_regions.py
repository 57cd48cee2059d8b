"""Find the shortest way of a small ball through a scene, with a proof that none is shorter.

    .venv/bin/python examples/path_through_regions.py

The scene is the demo's robot cell as it starts, or any other scene file. Regions grow among its
obstacles; the ball's middle may be where it is no nearer to a face than its radius. What is
straight between two points of a region is in the region; where two regions meet, a way can go on
in the other. The shortest path through this graph of convex sets is drawn, and what the relaxation
makes of it: the thicker and the stronger in colour, the more of its flow.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import dataclasses
import itertools
import math
from pathlib import Path
import sys
import time

from common.picture import Camera, trace
from free_regions import ROOM, scene_markers, scene_of
from geometry_msgs import msg
from geometry_msgs.msg import Quaternion, Vector3
import numpy as np
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    GraphOfConvexSetsResult,
    HPolyhedron,
    Hyperellipsoid,
    iris,
    make_iris_obstacles,
    norm,
    Point,
    SolverError,
    Vertex,
)
from scene_graph_ros.scene_files import SceneFileError

ROOT = Path(__file__).parents[1]
RADIUS = 0.04
"""Metres, of the ball."""
START, GOAL = (0.6, 0.1, 0.2), (-0.1, 0.8, 0.95)
"""Under the table, and in a compartment of the shelf."""
SAMPLES = (
    (0.55, 0.0, 0.75),
    (0.0, 0.62, 0.9),
    (-0.45, -0.3, 0.8),
    (1.02, 0.2, 0.3),
    (0.5, -0.72, 0.4),
    (0.5, 0.8, 0.4),
    (0.05, 0.35, 0.3),
    (-0.5, 0.5, 0.5),
    (0.3, 0.5, 1.2),
)
"""Over the table, before the shelf, on all sides of both, and above."""
NO_FLOW, FLOW = np.array([0.93, 0.88, 0.78]), np.array([0.95, 0.45, 0.0])
PATH, END = (0.1, 0.45, 0.9), (0.85, 0.15, 0.2)
THIN, THICK = 0.003, 0.026
"""Metres. Diameters of rods for the least flow that is drawn, and for all of it and the path."""
CAMERA = Camera(
    eye=(3.15, -0.75, 0.92), target=(0.2, 0.27, 0.63), field_of_view=34.0, width=840, height=600
)
LEAST_FLOW = 0.03
"""Less is not drawn."""


def options_of_a_way(description: str | None, picture: str) -> argparse.ArgumentParser:
    """Return the options of who looks for a ball's way; ``picture`` is a name in the checkout."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    scene = ROOT / "config" / "scenes" / "panda_cell.yaml"
    parser.add_argument("--scene", type=Path, default=scene)
    place = {"type": float, "nargs": 3, "metavar": ("X", "Y", "Z")}
    parser.add_argument("--start", default=START, help="where the way begins, metres", **place)
    parser.add_argument("--goal", default=GOAL, help="where it ends, metres", **place)
    parser.add_argument("--radius", type=float, default=RADIUS, help="of the ball, metres")
    parser.add_argument(
        "--sample", action="append", help="where a region begins, besides both ends", **place
    )
    parser.add_argument("--output", type=Path, default=Path(picture))
    parser.add_argument("--width", type=int, default=CAMERA.width, help="of the picture, pixels")
    parser.add_argument("--no-picture", action="store_true", help="only find the way")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Grow, join, solve, and draw."""
    options = options_of_a_way(__doc__, "path_through_regions.png").parse_args(arguments)
    query = scene_of(options.scene)
    ball = Hyperellipsoid.make_hypersphere(options.radius, np.zeros(3))
    obstacles = make_iris_obstacles(query)
    begin = time.perf_counter()
    ends = (options.start, options.goal)
    grown = [iris(obstacles, at, ROOM) for at in (*ends, *(options.sample or SAMPLES))]
    narrowed = [region.pontryagin_difference(ball) for region in grown]
    regions = [region.reduce_inequalities() for region in narrowed if not region.is_empty()]
    seconds = time.perf_counter() - begin
    print(f"{len(regions)} regions among {len(obstacles)} obstacles, {seconds:.1f} s")

    graph, start, goal = join(regions, ends)
    print(f"{graph.num_vertices} sets of steps, {graph.num_edges} edges")
    relaxed = timed(
        "relaxation", graph, start, goal, GraphOfConvexSetsOptions(convex_relaxation=True)
    )
    result = timed("search", graph, start, goal, GraphOfConvexSetsOptions())
    if not result.is_success:
        print(f"No way: {result.reason}")
        return 1
    steps = [x.reshape(2, 3) for x in result.points[1:-1]]
    visited = [v for number in result.vertices for v in graph.vertices if v.id == number]
    outside = max(
        v.set.projection(x[None]).distances.max()
        for v, x in zip(visited, result.points, strict=True)
    )
    print(f"{len(steps)} steps, each in its region to {outside:.0e} m")
    if not options.no_picture:
        print("Drawing ...", flush=True)
        height = round(options.width * CAMERA.height / CAMERA.width)
        camera = dataclasses.replace(CAMERA, width=options.width, height=height)
        markers = scene_markers(query) + drawn(graph, relaxed, result, options.radius)
        trace(markers, camera, samples=32).save(options.output)
        print(f"Picture: {options.output}")
    return 0


def join(
    regions: Sequence[HPolyhedron], ends: Sequence[Sequence[float]]
) -> tuple[GraphOfConvexSets, Vertex, Vertex]:
    """Return a graph of the ends and of straight steps, each through one region.

    A step is the six coordinates of where it begins and where it ends.
    """
    graph = GraphOfConvexSets()
    start, goal = (graph.add_vertex(Point(np.tile(end, 2))) for end in ends)
    steps = []
    for k, region in enumerate(regions):
        step = graph.add_vertex(region.cartesian_power(2), f"region {k}")
        step.add_cost(norm(step.x[3:] - step.x[:3]))
        steps.append(step)
    pairs = [(steps[i], steps[j]) for i, j in meeting(regions)]
    pairs += [(start, s) for s, r in zip(steps, regions, strict=True) if r.point_in_set(ends[0])]
    pairs += [(s, goal) for s, r in zip(steps, regions, strict=True) if r.point_in_set(ends[1])]
    for u, v in pairs:
        edge = graph.add_edge(u, v)
        edge.add_constraint(edge.xu[3:] == edge.xv[:3])
    return graph, start, goal


def meeting(regions: Sequence[HPolyhedron]) -> list[tuple[int, int]]:
    """Return the pairs of regions, in both orders, that have points in common."""
    return [
        pair
        for i, j in itertools.combinations(range(len(regions)), 2)
        if regions[i].intersects_with(regions[j])
        for pair in ((i, j), (j, i))
    ]


def timed(
    name: str,
    graph: GraphOfConvexSets,
    start: Vertex,
    goal: Vertex,
    options: GraphOfConvexSetsOptions,
) -> GraphOfConvexSetsResult:
    """Solve, and say what came of it."""
    begin = time.perf_counter()
    result = graph.solve_shortest_path(start, goal, options)
    seconds = time.perf_counter() - begin
    print(
        f"{name}: {result.cost:.6f} m, no way is below {result.lower_bound:.6f} m, gap"
        f" {result.gap:.1e} m, {seconds:.2f} s: {result.reason}"
    )
    return result


def drawn(
    graph: GraphOfConvexSets,
    relaxed: GraphOfConvexSetsResult,
    result: GraphOfConvexSetsResult,
    radius: float,
) -> list[Marker]:
    """Return the relaxation's flows and the path as rods, the ball at both ends."""
    markers = []
    flows = {edge: relaxed.flows.get(edge.id, 0.0) for edge in graph.edges}
    for vertex in graph.vertices:
        # What comes in goes out by each edge, in the same shares.
        into = [e for e in vertex.incoming_edges if flows[e] > LEAST_FLOW]
        out = [e for e in vertex.outgoing_edges if flows[e] > LEAST_FLOW]
        total = sum(flows[e] for e in into)
        for first, last in itertools.product(into, out):
            flow = flows[first] * flows[last] / total
            if flow > LEAST_FLOW:
                way = [relaxed.phi_xv[e.id][:3] / flows[e] for e in (first, last)]
                share = math.sqrt(flow)
                color = NO_FLOW + share * (FLOW - NO_FLOW)
                markers.append(rod(*way, THIN + flow * (THICK - THIN), color))
    for step in (x.reshape(2, 3) for x in result.points[1:-1]):
        markers.append(rod(*step, THICK, PATH))
        markers.append(sphere(step[1], 1.4 * THICK, PATH))
    ends = (result.points[0][:3], result.points[-1][:3])
    return [*markers, *(sphere(x, 2.0 * radius, END) for x in ends)]


def sphere(x: np.ndarray, diameter: float, color: Sequence[float]) -> Marker:
    """Return a ball of a colour."""
    size = Vector3(x=diameter, y=diameter, z=diameter)
    marker = Marker(type=Marker.SPHERE, color=rgb(color), scale=size)
    marker.pose.position = msg.Point(**dict(zip("xyz", x.tolist(), strict=True)))
    return marker


def rod(
    first: np.ndarray, last: np.ndarray, diameter: float, color: Sequence[float] | np.ndarray
) -> Marker:
    """Return a cylinder from one point to another."""
    way = last - first
    length = float(np.linalg.norm(way))
    size = Vector3(x=diameter, y=diameter, z=length)
    marker = Marker(type=Marker.CYLINDER, color=rgb(color), scale=size)
    marker.pose.position = msg.Point(
        **dict(zip("xyz", (0.5 * (first + last)).tolist(), strict=True))
    )
    # Half the way from z to the rod's direction.
    half = way / max(length, 1e-300) + [0.0, 0.0, 1.0 + 1e-12]
    axis = np.cross([0.0, 0.0, 1.0], half / np.linalg.norm(half))
    x, y, z = axis.tolist()
    marker.pose.orientation = Quaternion(x=x, y=y, z=z, w=math.sqrt(max(0.0, 1.0 - axis @ axis)))
    return marker


def rgb(color: Sequence[float] | np.ndarray) -> ColorRGBA:
    """Return a colour that hides what is behind it."""
    return ColorRGBA(**dict(zip("rgb", map(float, color), strict=True)), a=1.0)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (ConvexSetError, SceneFileError, SolverError, OSError) as error:
        sys.exit(f"error: {error}")
