"""Boxes of configurations that are free of collisions, by planes between geometries.

A box of q is one of s = tan((q - q_star) / 2), as each s grows with its own q alone: with q_star
in its middle the tangents stay small.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.tolerances import EPSILON
from scene_graph_ros.planning.certified.cspace_free_polytope import CspaceFreePolytope
from scene_graph_ros.planning.certified.distance_certificate import DistanceCertificate
from scene_graph_ros.planning.certified.distance_search import certify_by_distances
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.pair_certificate import PairCertificate
from scene_graph_ros.planning.certified.polytope_certificate import (
    GeometryPair,
    PairFailure,
    PolytopeCertificate,
)
from scene_graph_ros.planning.certified.separating_planes import CSpaceSeparatingPlane
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.parallel.in_executor import AnyExecutor

__all__ = ["CspaceFreeBox"]

_ROUNDING = 8.0 * EPSILON
"""Relative: more than a tangent and its argument are off by, so that the box is in the region."""

Box = tuple[NDArray[np.float64], NDArray[np.float64]]


@one_line()
class CspaceFreeBox:
    """Proves that robots collide with nothing in boxes ``lower <= q <= upper``.

    The same as `CspaceFreePolytope` for polytopes of s about one q_star, with one in the middle of
    each box. Joints, shapes, pairs and paddings are as there.
    """

    def __init__(self, checker: SceneGraphCollisionChecker) -> None:
        """Raise CertificateError for another checker and other joints."""
        self._first = CspaceFreePolytope(checker)
        self._checker = checker.clone()

    @property
    def geometry_pairs(self) -> tuple[GeometryPair, ...]:
        """The pairs of geometry ids that need a plane."""
        return self._first.geometry_pairs

    @property
    def separating_planes(self) -> tuple[CSpaceSeparatingPlane, ...]:
        """The plane that is to be between each pair; certificates say which is whose."""
        return self._first.separating_planes

    @property
    def map_geometries_to_separating_planes(self) -> dict[GeometryPair, int]:
        """Which of `separating_planes` is between two geometries, by their ids."""
        return self._first.map_geometries_to_separating_planes

    def find_separation_certificate_given_box(
        self,
        q_box_lower: ArrayLike,
        q_box_upper: ArrayLike,
        ignored_collision_pairs: Iterable[GeometryPair] = (),
        *,
        terminate_at_failure: bool = True,
        most_clearance: bool = True,
        executor: AnyExecutor | None = None,
    ) -> PolytopeCertificate:
        """Return a certificate of a box ``(nq,)``, ``(nq,)`` within the joints' limits.

        All else is as of `CspaceFreePolytope.find_separation_certificate_given_polytope`. Raises
        CertificateError for a box that is empty, flat, or half a turn or more from its middle to
        its sides, and as that does.
        """
        search, C, d = self._search(self._checked(q_box_lower, q_box_upper))
        return search.find_separation_certificate_given_polytope(
            C,
            d,
            ignored_collision_pairs,
            terminate_at_failure=terminate_at_failure,
            most_clearance=most_clearance,
            executor=executor,
        )

    def find_pair_certificate(
        self, geometry_pair: GeometryPair, q_box_lower: ArrayLike, q_box_upper: ArrayLike
    ) -> PairCertificate | PairFailure:
        """Return the certificate of one pair in a box, ``(nq,)`` each. Raises CertificateError."""
        search, C, d = self._search(self._checked(q_box_lower, q_box_upper))
        return search.find_pair_certificate(geometry_pair, C, d)

    def certify_by_distances(
        self,
        q_box_lower: ArrayLike,
        q_box_upper: ArrayLike,
        *,
        max_boxes: int = 1_000_000,
        threads: int = 1,
    ) -> DistanceCertificate:
        """Return the certificate by distances of a box, ``(nq,)`` each; see the function."""
        box = HPolyhedron.make_box(*self._checked(q_box_lower, q_box_upper))
        return certify_by_distances(self._checker, box, max_boxes=max_boxes, threads=threads)

    def _search(
        self, box: Box
    ) -> tuple[CspaceFreePolytope, NDArray[np.float64], NDArray[np.float64]]:
        """Return a search about the middle of a box, and the box in s, rounded outwards."""
        lower, upper = box
        search = CspaceFreePolytope(self._checker, lower + 0.5 * (upper - lower))
        ends = search.rational_forward_kinematics.compute_s_value(np.stack(box))
        room = _ROUNDING * np.abs(ends)
        unit = np.eye(len(lower))
        d = np.concatenate([ends[1] + room[1], room[0] - ends[0]])
        return search, np.concatenate([unit, -unit]), d

    def _checked(self, lower: ArrayLike, upper: ArrayLike) -> Box:
        n = self._checker.plan.tree.num_positions
        ends = []
        for name, values in (("q_box_lower", lower), ("q_box_upper", upper)):
            array = real_array(values, f"{name} must be {n} finite numbers", CertificateError)
            if array.shape != (n,) or not np.isfinite(array).all():
                raise CertificateError(f"{name} must be {n} finite numbers, not {quoted(values)}")
            ends.append(array)
        if not (ends[0] < ends[1]).all():
            k = int(np.argmin(ends[1] - ends[0]))
            position = self._checker.plan.tree.position_names[k]
            raise CertificateError(
                f"q_box_upper must be above q_box_lower; of {position!r} they are {ends[1][k]} and"
                f" {ends[0][k]}"
            )
        return ends[0], ends[1]
