"""Checks of the seeds of regions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.regions.errors import RegionError
from scene_graph_ros.planning.regions.feasibility import Feasibility
from scene_graph_ros.planning.regions.parameterization import IrisParameterizationFunction
from scene_graph_ros.robots.tree_kernels import FLOATING

__all__ = [
    "checked_box",
    "checked_center",
    "checked_domain",
    "checked_domain_of",
    "checked_kept",
    "checked_points",
    "domain_of_limits",
    "ellipsoid_map",
    "refuse_parameterization",
]

_INSIDE = 1e-8
"""rad or m: how far outside of the hull of the points to keep the centre may be."""


def domain_of_limits(
    checker: CollisionChecker, rows: NDArray[np.intp] | None = None
) -> HPolyhedron:
    """Return the box of positions' limits, of all or some ``(k,)``.

    Raises RegionError where one has none.
    """
    tree = checker.model.tree
    chosen = np.arange(tree.num_positions) if rows is None else rows
    lower, upper = tree.lower[chosen], tree.upper[chosen]
    endless = np.flatnonzero(~np.isfinite(lower) | ~np.isfinite(upper))
    if len(endless):
        raise RegionError(
            f"position {tree.position_names[chosen[endless[0]]]!r} has no limits; give a domain,"
            " such as HPolyhedron.make_box"
        )
    return HPolyhedron.make_box(lower, upper)


def checked_domain(
    checker: CollisionChecker, domain: Any, rows: NDArray[np.intp] | None = None
) -> HPolyhedron:
    """Return a bounded domain of a checker's configurations; None: that of its limits.

    With ``rows`` ``(k,)`` it is one of these positions alone.
    """
    tree = checker.model.tree
    for joint, start in zip(tree.joints, tree.table.starts[1:], strict=True):
        if joint.kind == FLOATING and (rows is None or start in rows):
            raise RegionError(
                f"joint {joint.name!r} floats: quaternions have no convex regions; weld it, or"
                " plan with plan_path"
            )
    if domain is None:
        return domain_of_limits(checker, rows)
    return checked_box(domain, tree.num_positions if rows is None else len(rows))


def checked_domain_of(
    parameterization: IrisParameterizationFunction | None, checker: CollisionChecker, domain: Any
) -> HPolyhedron:
    """Return a bounded domain of a region's points, with a parameterization or without.

    Raises RegionError.
    """
    if parameterization is None:
        return checked_domain(checker, domain)
    return checked_box(domain, parameterization.dimension)


def checked_box(domain: Any, n: int | None = None) -> HPolyhedron:
    """Return a bounded domain in n dimensions, or in any. Raises RegionError."""
    if not isinstance(domain, HPolyhedron) or n not in (None, domain.ambient_dimension):
        some = "" if n is None else f" in {n} dimensions"
        raise RegionError(f"domain must be an HPolyhedron{some}, not {quoted(domain)}")
    if domain.is_empty():
        raise RegionError("domain is empty")
    if not domain.is_bounded():
        raise RegionError("domain is unbounded; intersect it with a box, HPolyhedron.make_box")
    named = np.linalg.norm(domain.A, axis=1)
    rows = named > 0.0
    return HPolyhedron(domain.A[rows] / named[rows, np.newaxis], domain.b[rows] / named[rows])


def refuse_parameterization(options: Any, where: str) -> None:
    """Raise RegionError for options with a parameterization, which are for one region alone."""
    if getattr(options, "parameterization", None) is not None:
        raise RegionError(
            f"{where}: options have a parameterization, with which regions are none of"
            " configurations; use iris_zo or iris_in_configuration_space"
        )


def ellipsoid_map(ellipsoid: Any, n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return map ``(n, n)`` and centre ``(n,)`` of an ellipsoid that is not flat."""
    label = "starting_ellipsoid"
    try:
        ball = ellipsoid if isinstance(ellipsoid, AffineBall) else AffineBall(ellipsoid)
        if ball.ambient_dimension == n:
            ball.inverse()
            return np.array(ball.B), np.array(ball.center)
    except (ConvexSetError, AttributeError, TypeError) as error:
        raise RegionError(
            f"{label} must be a Hyperellipsoid in {n} dimensions, bounded and not flat: {error}"
        ) from None
    raise RegionError(f"{label} must be in {n} dimensions, not {ball.ambient_dimension}")


def checked_points(name: str, points: ArrayLike, n: int) -> NDArray[np.float64]:
    """Return points ``(m, n)``, m at least 1, also of one ``(n,)``. Raises RegionError."""
    array = real_array(points, f"{name} must be finite numbers (m, {n})", RegionError)
    if array.ndim == 1:
        array = array[np.newaxis]
    if array.ndim != 2 or array.shape[1] != n or not len(array) or not np.isfinite(array).all():
        raise RegionError(f"{name} must be finite numbers (m, {n}), not {quoted(points)}")
    return array


def checked_center(
    feasibility: Feasibility, domain: HPolyhedron, center: NDArray[np.float64], name: str
) -> None:
    """Raise RegionError unless a configuration ``(n,)`` is in the domain and free."""
    if not domain.point_in_set(center, 0.0):
        outside = float((domain.A @ center - domain.b).max())
        raise RegionError(f"{name} {center.tolist()} is outside the domain by {outside:.3g}")
    if not feasibility.free(center[np.newaxis])[0]:
        raise RegionError(
            f"{name} {center.tolist()} is not free: {_why(feasibility, center)}; begin at a free"
            " configuration"
        )


def checked_kept(
    feasibility: Feasibility,
    domain: HPolyhedron,
    center: NDArray[np.float64],
    points: ArrayLike | None,
) -> NDArray[np.float64]:
    """Return points to keep ``(k, n)``: free, in the domain, with the centre in their hull."""
    n = domain.ambient_dimension
    if points is None:
        return np.zeros((0, n))
    kept = checked_points("containment_points", points, n)
    for k, each in enumerate(kept):
        checked_center(feasibility, domain, each, f"containment_points[{k}]")
    if not VPolytope(kept).point_in_set(center, _INSIDE):
        raise RegionError(
            "containment_points must have the centre of starting_ellipsoid in their hull,"
            f" {center.tolist()}"
        )
    return kept


def _why(feasibility: Feasibility, q: NDArray[np.float64]) -> str:
    """Return the reason why a configuration, or a region's point, is not free."""
    q = feasibility.configurations(q[np.newaxis])[0]
    for k, obstacle in enumerate(feasibility.obstacles):
        if obstacle.point_in_set(q, 0.0):
            return f"it is in configuration_obstacles[{k}]"
    find = getattr(feasibility.checker, "find_collisions", None)
    if find is None:
        return "the checker or a constraint says so"
    found = find(q[np.newaxis])
    if not len(found.rows):
        return "it violates additional_constraints"
    from scene_graph_ros.planning.checker.path_ends import pair_words

    words = pair_words(feasibility.checker, found.pairs[0])
    return f"{words} overlap by {1e3 * found.depths[0]:.4g} mm"
