"""Calls that compile the kernels of convex sets."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.optimization import (
    AffineBall,
    compute_pairwise_intersections,
    GraphOfConvexSets,
    HPolyhedron,
    Hyperrectangle,
    norm,
    VPolytope,
)

__all__ = ["ask_convex_sets"]


def ask_convex_sets() -> None:
    """Ask a square and its corners for a point, distances, ellipsoids, samples and a path."""
    square, corners = HPolyhedron.make_unit_box(2), VPolytope.make_unit_box(2)
    square.is_empty(certificate=True)
    for answer in (
        square.is_empty,
        square.is_bounded,
        square.find_redundant,
        square.chebyshev_center,
    ):
        answer()
    square.contained_in(square)
    compute_pairwise_intersections([HPolyhedron(square.A + 0.1, square.b)] * 2)
    for each in (square, corners):
        each.projection(np.full((1, 2), 2.0))
    VPolytope(square)
    Hyperrectangle.maybe_calc_axis_aligned_bounding_box(HPolyhedron(square.A + 0.1, square.b))
    square.support([1.0, 1.0])
    square.maximum_volume_inscribed_ellipsoid()
    AffineBall.minimum_volume_circumscribed_ellipsoid(corners.vertices)
    square.uniform_sample(np.random.default_rng(0))
    square.uniform_samples(np.random.default_rng(0), 1)
    graph = GraphOfConvexSets()
    edge = graph.add_edge(graph.add_vertex(square), graph.add_vertex(corners))
    edge.add_cost(norm(edge.xv - edge.xu))
    graph.solve_shortest_path(edge.u, edge.v).relaxation()
