"""Find a ball's fastest trajectory through a scene, and show that it is free at all times.

    .venv/bin/python examples/trajectory_through_regions.py

The scene is the demo's robot cell as it starts, or any other scene file. Regions grow among its
obstacles, each face proven to keep them out. A curve of order 4 leads through each region on the
way, with velocities within bounds at all times, and with a direction and curvature that go on from
region to region. Its control points are no nearer to a region's face than the ball's radius, which
is checked in rational arithmetic; a curve is in the hull of its control points, so the ball is in
the regions at all times. The same path is then retimed to keep a limit of acceleration, too.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import dataclasses
from fractions import Fraction
import itertools
import sys
import time

from common.picture import trace
from free_regions import ROOM, scene_markers, scene_of
import numpy as np
from path_through_regions import (
    CAMERA,
    END,
    FLOW,
    options_of_a_way,
    PATH,
    rod,
    SAMPLES,
    sphere,
    THICK,
)
from visualization_msgs.msg import Marker

from scene_graph_ros.geometry import QueryObject
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    iris,
    make_iris_obstacles,
    Point,
    SolverError,
)
from scene_graph_ros.planning import GcsTrajectoryOptimization, GcsTrajectoryResult
from scene_graph_ros.planning.trajectories import (
    CompositeTrajectory,
    MotionLimits,
    retime,
    TrajectoryError,
)
from scene_graph_ros.scene_files import SceneFileError

ORDER = 4
SPEED = 0.5
"""m/s, along each axis."""
ACCELERATION = 2.0
"""m/s^2, along each axis, of the retimed path."""
ENERGY = 0.05
"""What a squared metre between neighbouring control points costs beside a second."""
MARGIN = 1e-6
"""Metres by which control points stay farther from faces than the radius: more than rounding."""
DRAWN = 240
"""Places at which the curve is drawn, and the distance to the scene is measured."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Grow, solve, prove, retime and draw."""
    parser = options_of_a_way(__doc__, "trajectory_through_regions.png")
    parser.add_argument("--speed", type=float, default=SPEED, help="along each axis, m/s")
    options = parser.parse_args(arguments)
    query = scene_of(options.scene)
    ends = (options.start, options.goal)
    grown = grow(query, (*ends, *(options.sample or SAMPLES)))
    ball = Hyperellipsoid.make_hypersphere(options.radius + MARGIN, np.zeros(3))
    narrowed = [region.pontryagin_difference(ball) for region in grown]
    rooms = [k for k, region in enumerate(narrowed) if not region.is_empty()]
    trajectory, result = solve([narrowed[k].reduce_inequalities() for k in rooms], ends, options)
    if trajectory is None:
        print(f"No trajectory: {result.reason}")
        return 1
    visited = [rooms[number_of(vertex.name)] for vertex in result.vertices[1:-1]]
    clear = keeps_clear(trajectory, [grown[k] for k in visited], options.radius)
    print(
        f"ball inside the {len(visited)} regions on its way at all times:"
        f" {'proven' if clear else 'not proven'}"
    )
    print(
        f"least distance to the scene at {DRAWN} times: {least_distance(query, trajectory):.4f} m"
    )
    retimed(trajectory, options.speed)
    if not options.no_picture:
        print("Drawing ...", flush=True)
        height = round(options.width * CAMERA.height / CAMERA.width)
        camera = dataclasses.replace(CAMERA, width=options.width, height=height)
        markers = scene_markers(query) + drawn(trajectory, options.radius)
        trace(markers, camera, samples=32).save(options.output)
        print(f"Picture: {options.output}")
    return 0 if clear else 1


def grow(query: QueryObject, seeds: Sequence[Sequence[float]]) -> list[HPolyhedron]:
    """Return a region around each seed, with the proof that no obstacle is in it."""
    obstacles = make_iris_obstacles(query)
    begin = time.perf_counter()
    found = [iris(obstacles, at, ROOM, certificate=True) for at in seeds]
    proofs = [s.certificate.verify() for record in found for s in record.separations]
    print(
        f"{len(found)} regions among {len(obstacles)} obstacles, {sum(proofs)} of {len(proofs)}"
        f" times an obstacle is proven to be outside, {time.perf_counter() - begin:.1f} s"
    )
    return [record.region for record in found]


def solve(
    regions: Sequence[HPolyhedron], ends: Sequence[Sequence[float]], options: argparse.Namespace
) -> tuple[CompositeTrajectory | None, GcsTrajectoryResult]:
    """Return the fastest trajectory through regions, with what none is faster than."""
    begin = time.perf_counter()
    graph = GcsTrajectoryOptimization(3)
    free = graph.add_regions(regions, ORDER, name="free")
    start, goal = (
        graph.add_regions([Point(end)], 0, name=name)
        for name, end in zip(("start", "goal"), ends, strict=True)
    )
    graph.add_edges(start, free)
    graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_path_energy_cost(ENERGY**0.5)
    graph.add_velocity_bounds([-options.speed] * 3, [options.speed] * 3)
    graph.add_path_continuity_constraints(2)
    added = time.perf_counter() - begin
    for name, relaxed in (("best of the relaxation", True), ("searched", False)):
        begin = time.perf_counter()
        trajectory, result = graph.solve_path(
            start, goal, GraphOfConvexSetsOptions(convex_relaxation=relaxed)
        )
        print(
            f"{name}: cost {result.cost:.6f}, none is below {result.lower_bound:.6f}, gap"
            f" {result.gap:.1e}, {time.perf_counter() - begin:.1f} s: {result.reason}"
        )
    print(f"{graph.graph_of_convex_sets.num_edges} edges, found in {added:.2f} s")
    if trajectory is not None:
        print(
            f"{trajectory.duration:.3f} s, velocities beyond their bounds by"
            f" {result.velocity_excess:.0e}, jumps of {result.jump:.0e}, {result.outside:.0e} m"
            " outside of regions"
        )
    return trajectory, result


def number_of(name: str) -> int:
    """Return the number of a region from its vertex's name."""
    return int(name.partition("[")[2].rstrip("]"))


def keeps_clear(
    trajectory: CompositeTrajectory, regions: Sequence[HPolyhedron], radius: float
) -> bool:
    """Show that a ball around each control point is in its segment's region, in fractions.

    A face ``a . x <= b`` is no nearer than r where ``b - a . x >= r |a|``.
    """
    r_squared = Fraction(radius) ** 2
    for segment, region in zip(trajectory.segments, regions, strict=True):
        points = segment.derivative(0).control_points  # type: ignore[attr-defined]
        rows = [[Fraction(v) for v in row] for row in region.A.tolist()]
        for p in points.tolist():
            x = [Fraction(v) for v in p]
            for a, b in zip(rows, region.b.tolist(), strict=True):
                left = Fraction(b) - sum(u * v for u, v in zip(a, x, strict=True))
                if left < 0 or left * left < r_squared * sum(u * u for u in a):
                    return False
    return True


def least_distance(query: QueryObject, trajectory: CompositeTrajectory) -> float:
    """Return how near the ball's middle comes to anything, at some times: measured, not proven."""
    times = np.linspace(trajectory.start_time, trajectory.end_time, DRAWN)
    distances = query.compute_signed_distance_to_points(trajectory.value(times))
    return float(min(distances.distance))


def retimed(trajectory: CompositeTrajectory, speed: float) -> None:
    """Say how long the same path takes from rest to rest with a limit of acceleration."""
    limits = MotionLimits(np.full(3, speed), np.full(3, ACCELERATION), ("x", "y", "z"))
    path = GcsTrajectoryOptimization.normalize_segment_times(trajectory).piecewise_polynomial()
    motion = retime(path, limits)
    print(
        f"along the same path from rest to rest, within {ACCELERATION:g} m/s^2, too:"
        f" {motion.duration:.3f} s"
    )


def drawn(trajectory: CompositeTrajectory, radius: float) -> list[Marker]:
    """Return the curve as rods, in turn blue and orange from region to region, and both ends."""
    markers = []
    for number, segment in enumerate(trajectory.segments):
        times = np.linspace(segment.start_time, segment.end_time, DRAWN // 6)
        points = segment.value(times)
        color = (PATH, FLOW)[number % 2]
        markers += [rod(a, b, THICK, color) for a, b in itertools.pairwise(points)]
        markers += [sphere(x, THICK, color) for x in points]
    ends = trajectory.value([trajectory.start_time, trajectory.end_time])
    return [*markers, *(sphere(x, 2.0 * radius, END) for x in ends)]


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (ConvexSetError, SceneFileError, SolverError, TrajectoryError, OSError) as error:
        sys.exit(f"error: {error}")
