"""Who is asked questions about known boxes: ours, ours with proofs, and Drake."""

from __future__ import annotations

from collections.abc import Callable
import logging
import math
from typing import Any

import numpy as np

from benchmarks.known_boxes import Box, Case, DECISIONS
from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    iris,
    norm,
    Point,
    VPolytope,
)

__all__ = ["DRAKE", "OURS", "PROVEN", "Ask", "engines"]

OURS, PROVEN, DRAKE = "ours", "ours, with certificate", "Drake"

Ask = Callable[[str, Box], Any]

_EXACT_DIMENSIONS = 3
"""In more, volumes are from samples."""

_VOLUME_ACCURACY = 0.01


def engines() -> dict[str, tuple[Ask, tuple[str, ...] | None]]:
    """Return who is asked, and which questions: all where that is None."""
    found: dict[str, tuple[Ask, tuple[str, ...] | None]] = {
        OURS: (_ours, None),
        PROVEN: (_proven, (*DECISIONS, "region among obstacles")),
    }
    drake = _drake()
    if drake is not None:
        found[DRAKE] = drake, None
    return found


def _ours(question: str, box: Box) -> Any:
    if question in DECISIONS:
        return [_decide(question, case) for case in box.cases[question]]
    if question == "circumscribed ellipsoid":
        around = Hyperellipsoid.minimum_volume_circumscribed_ellipsoid(box.hull_points)
        return -np.linalg.slogdet(around.A)[1]
    if question == "region among obstacles":
        return _region(box, certificate=False)
    if question == "shortest path":
        return _path(box)
    return _of_polyhedron(question, HPolyhedron(*box.rows), box)


def _decide(question: str, case: Case) -> Any:
    asked = HPolyhedron(*case.rows)
    if question == "emptiness":
        return asked.is_empty()
    if question == "redundancy":
        return asked.find_redundant(tol=0.0)
    assert case.other is not None
    other = HPolyhedron(*case.other)
    if question == "intersection":
        return asked.intersects_with(other)
    return asked.contained_in(other, tol=0.0)


def _proven(question: str, box: Box) -> Any:
    if question == "region among obstacles":
        return _region(box, certificate=True)
    return [_decide_proven(question, case) for case in box.cases[question]]


def _decide_proven(question: str, case: Case) -> Any:
    """Return the answer, None where its certificate doesn't hold; checking is in the time."""
    asked = HPolyhedron(*case.rows)
    if question == "redundancy":
        reduction = asked.reduce_inequalities(tol=0.0, certificate=True)[1]
        return set(reduction.removed) if reduction.verify(asked, tol=0.0) else None
    if question == "emptiness":
        decision = asked.is_empty(certificate=True)
    else:
        assert case.other is not None
        other = HPolyhedron(*case.other)
        if question == "intersection":
            decision = asked.intersects_with(other, certificate=True)
        else:
            decision = asked.contained_in(other, tol=0.0, certificate=True)
    return decision.value if decision.certificate.verify() else None


def _of_polyhedron(question: str, of: HPolyhedron, box: Box) -> Any:
    if question == "Chebyshev centre":
        return of.chebyshev_center()
    if question == "projection":
        found = of.projection(box.far[None])
        return float(found.distances[0]) if found is not None else math.nan
    if question == "bounding box":
        around = Hyperrectangle.maybe_calc_axis_aligned_bounding_box(of)
        return np.concatenate([around.lb, around.ub]) if around is not None else np.nan
    if question == "vertices":
        return VPolytope(of).vertices
    if question == "volume":
        if box.n <= _EXACT_DIMENSIONS:
            return of.calc_volume()
        return of.calc_volume_interval(np.random.default_rng(1), _VOLUME_ACCURACY).volume
    if question == "inscribed ellipsoid":
        return -np.linalg.slogdet(of.maximum_volume_inscribed_ellipsoid().A)[1]
    assert question == "scaling to touch"
    ball = Hyperellipsoid.make_hypersphere(0.01 * box.size, box.far)
    return ball.minimum_uniform_scaling_to_touch(of)[0]


def _region(box: Box, *, certificate: bool) -> tuple[np.ndarray, np.ndarray]:
    walls = [HPolyhedron(*rows) for rows in box.walls]
    reach = 20.0 * box.size
    domain = HPolyhedron.make_box(box.center - reach, box.center + reach)
    if not certificate:
        region = iris(walls, box.center, domain)
        return region.A, region.b
    found = iris(walls, box.center, domain, certificate=True)
    assert all(each.certificate.verify() for each in found.separations)
    return found.region.A, found.region.b


def _path(box: Box) -> float:
    graph = GraphOfConvexSets()
    start, slab, goal = box.stations
    sets = Point(start), HPolyhedron(*slab), Point(goal)
    s, m, t = (graph.add_vertex(each) for each in sets)
    for u, v in ((s, m), (m, t)):
        edge = graph.add_edge(u, v)
        edge.add_cost(norm(edge.xv - edge.xu))
    options = GraphOfConvexSetsOptions(convex_relaxation=True)
    return float(graph.solve_shortest_path(s, t, options).cost)


def _drake() -> Ask | None:
    try:
        import pydrake.geometry.optimization as drake
    except ImportError:
        return None
    logging.getLogger("drake").setLevel(logging.CRITICAL)

    def ask(question: str, box: Box) -> Any:
        if question in DECISIONS:
            return [_drakes_decision(question, case, drake) for case in box.cases[question]]
        if question == "circumscribed ellipsoid":
            of_points = drake.Hyperellipsoid.MinimumVolumeCircumscribedEllipsoid
            return -float(np.linalg.slogdet(of_points(box.hull_points.T).A())[1])
        if question == "region among obstacles":
            return _drakes_region(box, drake)
        if question == "shortest path":
            return _drakes_path(box, drake)
        return _of_drakes_polyhedron(question, drake.HPolyhedron(*box.rows), box, drake)

    return ask


def _drakes_decision(question: str, case: Case, drake: Any) -> Any:
    asked = drake.HPolyhedron(*case.rows)
    if question == "emptiness":
        return asked.IsEmpty()
    if question == "redundancy":
        return set(asked.FindRedundant(tol=0.0))
    other = drake.HPolyhedron(*case.other)
    if question == "intersection":
        return asked.IntersectsWith(other)
    return asked.ContainedIn(other, tol=0.0)


def _of_drakes_polyhedron(question: str, of: Any, box: Box, drake: Any) -> Any:
    if question == "Chebyshev centre":
        return of.ChebyshevCenter()
    if question == "projection":
        return float(of.Projection(box.far[:, None])[0][0])
    if question == "bounding box":
        around = drake.Hyperrectangle.MaybeCalcAxisAlignedBoundingBox(of)
        return np.concatenate([around.lb(), around.ub()])
    if question == "vertices":
        return drake.VPolytope(of).vertices().T
    if question == "volume":
        if box.n <= _EXACT_DIMENSIONS:
            return drake.VPolytope(of).CalcVolume()
        from pydrake.common import RandomGenerator

        return of.CalcVolumeViaSampling(RandomGenerator(1), _VOLUME_ACCURACY, 10_000).volume
    if question == "inscribed ellipsoid":
        return -float(np.linalg.slogdet(of.MaximumVolumeInscribedEllipsoid().A())[1])
    assert question == "scaling to touch"
    ball = drake.Hyperellipsoid.MakeHypersphere(0.01 * box.size, box.far)
    return float(ball.MinimumUniformScalingToTouch(of)[0])


def _drakes_region(box: Box, drake: Any) -> tuple[np.ndarray, np.ndarray]:
    walls = [drake.HPolyhedron(*rows) for rows in box.walls]
    reach = 20.0 * box.size
    domain = drake.HPolyhedron.MakeBox(box.center - reach, box.center + reach)
    region = drake.Iris(walls, box.center, domain)
    return region.A(), region.b()


def _drakes_path(box: Box, drake: Any) -> float:
    from pydrake.solvers import Binding, Cost, L2NormCost

    graph = drake.GraphOfConvexSets()
    start, slab, goal = box.stations
    sets = drake.Point(start), drake.HPolyhedron(*slab), drake.Point(goal)
    s, m, t = (graph.AddVertex(each) for each in sets)
    unit = np.eye(box.n)
    for u, v in ((s, m), (m, t)):
        edge = graph.AddEdge(u, v)
        length = L2NormCost(np.concatenate([-unit, unit], axis=1), np.zeros(box.n))
        edge.AddCost(Binding[Cost](length, np.concatenate([edge.xu(), edge.xv()])))
    options = drake.GraphOfConvexSetsOptions()
    options.convex_relaxation, options.max_rounded_paths = True, 5
    found = graph.SolveShortestPath(s, t, options)
    return float(found.get_optimal_cost()) if found.is_success() else math.nan
