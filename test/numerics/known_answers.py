"""Regions, curved sets, plans and trajectories whose answers are known, and how far off they are.

Run it as ``python test/numerics/known_answers.py``: a line for each, and exit code 1 where one is
off by more than its page states. What is asked passes BLAS, NumPy's functions or a solver, so its
last bits depend on the machine; the errors that `docs/convex_sets_measured.md` and
`docs/trajectories.md` state do not. With ``--off 0 1e-12`` they are asked twice, the second time
with all inputs off by so much, one way or the other.
"""

import argparse
import itertools
import math
from pathlib import Path
import sys

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]

from scene_graph_ros.geometry.optimization import (  # noqa: E402
    GraphOfConvexSets,
    HPolyhedron,
    Hyperellipsoid,
    Intersection,
    iris,
    IrisOptions,
    MinkowskiSum,
    norm,
    Point,
    VPolytope,
)
from scene_graph_ros.planning import GcsTrajectoryOptimization  # noqa: E402
from scene_graph_ros.planning.trajectories import (  # noqa: E402
    MotionLimits,
    PiecewisePolynomial,
    retime,
)

CORNER = ([0.0, 0.0], [3.0, 1.0]), ([2.0, 0.0], [3.0, 3.0])
"""Boxes of an L: the way from (0.2, 0.5) to (2.5, 2.8) goes by (2, 1)."""
START, GOAL = [0.2, 0.5], [2.5, 2.8]
CORNER_COST = 7.618
"""Time and a tenth of the length around the corner with velocities and accelerations that go on.

The best of 60 random starts of an interior-point method (test/planning/gcs/test_gcs_nonlinear.py).
"""


def region_beside_a_wall(moved):
    """A wall from x = 1/2 on in the square of width 2: the largest ellipse has axes 3/4 and 1."""
    wall = VPolytope(moved([[0.5, -2.0], [1.0, -2.0], [1.0, 2.0], [0.5, 2.0]]))
    square = HPolyhedron.make_box(moved([-1.0, -1.0]), moved([1.0, 1.0]))
    options = IrisOptions(termination_threshold=-1.0)
    found = iris([wall], [0.0, 0.0], square, options, certificate=True)
    yield "volume of its ellipse", found.volumes[-1], 0.75 * math.pi, 1e-8
    proven = all(each.certificate.verify() for each in found.separations)
    yield "free of the wall", float(proven), 1.0, 0.0


def curved_sets(moved):
    """Balls of radius 1 and 2, and a lens of two balls of radius 5 with centres 6 apart."""
    way = np.array([2.0, 3.0, 6.0]) / 7.0
    one = Hyperellipsoid.make_hypersphere(1.0, moved(np.zeros(3)))
    two = Hyperellipsoid.make_hypersphere(2.0, moved(3.5 * way))
    apart = MinkowskiSum([one, two])  # distances of centres less both radii
    yield "meet", float(one.intersects_with(two)), 0.0, 0.0
    distance = apart.projection(moved(7.0 * way)[None]).distances[0]
    yield "distance", distance, 7.0 - 3.5 - 3.0, 1e-9 * 7.0
    left = Hyperellipsoid.make_hypersphere(5.0, moved([-3.0, 0.0, 0.0]))
    right = Hyperellipsoid.make_hypersphere(5.0, moved([3.0, 0.0, 0.0]))
    lens = Intersection([left, right])
    yield "tip of the lens", lens.support([0.0, 1.0, 0.0]).value, 4.0, 1e-7 * 5.0
    yield "end of the lens", lens.support([1.0, 0.0, 0.0]).value, 2.0, 1e-7 * 5.0


def ellipsoids(moved):
    """The largest in a box is its own; the least around its corners is larger by a root of 3."""
    sizes = np.array([1.0, 2.0, 3.0])
    box = HPolyhedron.make_box(moved(-sizes), moved(sizes))
    volume = 4.0 / 3.0 * math.pi * sizes.prod()
    inside = box.maximum_volume_inscribed_ellipsoid().calc_volume()
    yield "largest inside", inside, volume, 1e-7 * volume


def shortest_path(moved):
    """By the square in which an L's boxes meet: two legs by the corner (2, 1)."""
    graph = GraphOfConvexSets()
    square = HPolyhedron.make_box(moved([2.0, 0.0]), moved([3.0, 1.0]))
    sets = [Point(moved(START)), square, Point(moved(GOAL))]
    vertices = [graph.add_vertex(each) for each in sets]
    for u, v in itertools.pairwise(vertices):
        edge = graph.add_edge(u, v)
        edge.add_cost(norm(edge.xv - edge.xu))
    result = graph.solve_shortest_path(vertices[0], vertices[-1])
    truth = 2.0 * math.hypot(1.8, 0.5)
    yield "length", result.cost, truth, 1e-7 * truth
    yield "gap", result.gap, 0.0, 1e-7 * truth


def _around_the_corner(moved):
    graph = GcsTrajectoryOptimization(2)
    boxes = [HPolyhedron.make_box(moved(low), moved(high)) for low, high in CORNER]
    free = graph.add_regions(boxes, 4, name="free")
    start = graph.add_regions([Point(moved(START))], 0, name="start")
    goal = graph.add_regions([Point(moved(GOAL))], 0, name="goal")
    graph.add_edges(start, free)
    graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_velocity_bounds([-1.0, -0.5], [1.0, 0.5])
    return graph, start, goal


def trajectories(moved):
    """As long as the slower axis takes; with accelerations that go on, as good as is known."""
    graph, start, goal = _around_the_corner(moved)
    trajectory, result = graph.solve_path(start, goal)
    # The upper box begins at x = 2, after 1.8 s; from there y goes 1.8 m at 0.5 m/s.
    yield "least time", result.cost, 1.8 / 1.0 + 1.8 / 0.5, 1e-5
    graph, start, goal = _around_the_corner(moved)
    graph.add_path_length_cost(0.1)
    graph.add_path_continuity_constraints(1)
    graph.add_continuity_constraints(1)
    graph.add_continuity_constraints(2)
    trajectory, result = graph.solve_path(start, goal)
    yield "cost with accelerations that go on", result.cost, CORNER_COST, 1e-4 * CORNER_COST
    yield "jump of velocity", abs(trajectory.jumps(1)).max(), 0.0, 1e-9
    yield "excess of velocity", result.velocity_excess, 0.0, 1e-9


def retimed_line(moved):
    """A line from rest to rest: full acceleration, full speed, full braking."""
    line = PiecewisePolynomial.first_order_hold([0.0, 1.0], moved([[0.0], [3.0]]))
    motion = retime(line, MotionLimits([2.0], [4.0]))
    yield "time", motion.end_time - motion.start_time, 3.0 / 2.0 + 2.0 / 4.0, 1e-5 * 2.0


CORPUS = (
    region_beside_a_wall,
    curved_sets,
    ellipsoids,
    shortest_path,
    trajectories,
    retimed_line,
)


def failures(off):
    """Print how far off each answer is; return how many are off by more than is stated."""
    generator = np.random.default_rng(0)

    def moved(values):
        array = np.array(values, dtype=float)
        return array + off * generator.choice([-1.0, 1.0], array.shape)

    failed = 0
    for ask in CORPUS:
        for name, found, truth, bound in ask(moved):
            error = abs(found - truth)
            # Inputs that are off move an answer by at most some ten times as much.
            is_kept = error <= bound + 10.0 * off * (bound > 0.0)
            failed += not is_kept
            note = "" if is_kept else "  EXCEEDED"
            print(f"{off:5.0e} {ask.__name__:22} {name:34} {error:8.1e} of {bound:8.1e}{note}")
    return failed


def main():
    """Ask with inputs that are off by each of these; return how many answers are off by more."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--off", type=float, nargs="*", default=[0.0], help="of all inputs")
    return sum(map(failures, parser.parse_args().off))


if __name__ == "__main__":
    sys.exit(main() > 0)
