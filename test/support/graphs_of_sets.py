"""Graphs of convex sets for tests: edges that cost lengths, sets around points, what must hold."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.optimization import (
    AffineBall,
    CartesianProduct,
    ConvexHull,
    ConvexSet,
    Edge,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    GraphOfConvexSetsResult,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    MinkowskiSum,
    norm,
    Point,
    Vertex,
    VPolytope,
)

RELAXED = GraphOfConvexSetsOptions(convex_relaxation=True)
GAP = 1e-7
"""Relative: what the bound of a tight problem may be below the cost."""


def joined(graph: GraphOfConvexSets, u: Vertex, v: Vertex) -> Edge:
    """Add an edge that costs the length of its step."""
    edge = graph.add_edge(u, v)
    edge.add_cost(norm(edge.xv - edge.xu))
    return edge


def check(result: GraphOfConvexSetsResult, truth: float, gap: float = GAP) -> None:
    """The truth is between bound and cost, and these are near each other."""
    assert result.is_success, result.reason
    rounding = 1e-13 * truth
    assert result.lower_bound <= truth + rounding
    assert truth - rounding <= result.cost
    assert result.cost - result.lower_bound <= gap * truth
    assert result.gap == max(0.0, result.cost - result.lower_bound)


def around(kind: int, center: np.ndarray, size: float) -> ConvexSet:
    """Return a set that has a point and what is within a tenth of a size of it."""
    n = len(center)
    low, high = center - size, center + 0.4 * size
    corners = Hyperrectangle(low, high)
    kinds = (
        lambda: corners,
        lambda: HPolyhedron.make_box(low, high),
        lambda: VPolytope.make_box(low, high),
        lambda: Hyperellipsoid.make_hypersphere(size, center),
        lambda: AffineBall.make_axis_aligned(np.linspace(0.3, 1.0, n) * size, center),
        lambda: MinkowskiSum(corners, Hyperellipsoid.make_hypersphere(size, np.zeros(n))),
        lambda: ConvexHull([corners, Point(center + size)]),
        lambda: Intersection(corners, Hyperellipsoid.make_hypersphere(size, center)),
        lambda: CartesianProduct([Hyperrectangle([a], [b]) for a, b in zip(low, high)]),  # noqa: B905
    )
    return kinds[kind % len(kinds)]()
