"""The certificate of a polytope: one of each pair, or the reason for none."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
import numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.lagrangians import AffineFunction
from scene_graph_ros.planning.certified.pair_certificate import PairCertificate
from scene_graph_ros.planning.certified.pair_problem import PairProblems
from scene_graph_ros.planning.certified.rational_kinematics import RationalForwardKinematics
from scene_graph_ros.planning.certified.tangent_region import TangentRegion
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan

__all__ = ["PairFailure", "PolytopeCertificate", "checked_pairs"]

GeometryPair = tuple[GeometryId, GeometryId]


@one_line()
@dataclass(frozen=True, eq=False)
class PairFailure:
    """Why a pair has no certificate.

    ``status`` is ``collision``: it collides at ``q`` ``(nq,)``, which is in the polytope;
    ``no_plane``: the program's best clearance (m) is not positive, so that no plane of this kind
    was found, which does not say that there is a collision; ``rounding``: it is positive, and too
    small for a proof in rational arithmetic; ``solver``: the program was not solved.
    """

    names: tuple[str, str]
    status: str
    reason: str
    clearance: float = float("nan")
    q: NDArray[np.float64] | None = None


@one_line()
@dataclass(frozen=True, eq=False)
class PolytopeCertificate:
    """A polytope of s, and the certificate of each pair of geometries in it.

    ``region`` is the proof's domain: the polytope within the joints' limits, with bounds of
    each s. ``certificates`` and ``failures`` are by pairs of geometry ids. Pairs in neither were
    not looked at, as the search ended at a failure. ``ignored`` pairs were not to be looked at.
    """

    kinematics: RationalForwardKinematics
    plan: CheckerPlan = field(repr=False)
    inspector: Any = field(repr=False)
    region: TangentRegion
    certificates: Mapping[GeometryPair, PairCertificate]
    failures: Mapping[GeometryPair, PairFailure]
    ignored: frozenset[frozenset[int]] = frozenset()
    num_iter: int = 0
    """How many rounds of its search were made before it was found."""

    @property
    def is_success(self) -> bool:
        """Whether each pair that is checked and not ignored has a certificate."""
        return not self.failures and set(self.certificates) == {
            self.plan.ids(pair) for pair in self.pairs()
        }

    @property
    def certified_polytope(self) -> HPolyhedron:
        """The region in s; it is free only where this is a success."""
        return self.region.polyhedron

    @property
    def C(self) -> NDArray[np.float64]:
        """The polytope's rows ``(m, nq)`` that are about several positions, as in C s <= d."""
        return self.region.C

    @property
    def d(self) -> NDArray[np.float64]:
        """Their sides ``(m,)``. Rows about one position are in the bounds of s."""
        return self.region.d

    @property
    def s_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The bounds ``(nq,)`` of s within which it is proven, lower and upper."""
        return self.region.lower, self.region.upper

    @property
    def a(self) -> dict[int, AffineFunction]:
        """The normals of the planes, by the planes' indices; see `PairCertificate.a`."""
        return {each.plane_index: each.a for each in self.certificates.values()}

    @property
    def b(self) -> dict[int, AffineFunction]:
        """The offsets of the planes, by the planes' indices."""
        return {each.plane_index: each.b for each in self.certificates.values()}

    @property
    def distance(self) -> float:
        """Metres: the least distance of all pairs with a certificate, less their padding."""
        return min((each.distance for each in self.certificates.values()), default=float("inf"))

    def contains(self, q: Any) -> NDArray[np.bool_]:
        """Return a mask ``(m,)`` of the configurations ``(m, nq)`` with their s in the region."""
        return self.region.contains(self.kinematics.compute_s_value(q))

    def pairs(self) -> list[int]:
        """Return the rows of the plan's pairs that are not ignored."""
        ids = [self.plan.ids(pair) for pair in range(len(self.plan.pairs.bodies))]
        return [
            pair
            for pair, (a, b) in enumerate(ids)
            if frozenset({int(a), int(b)}) not in self.ignored
        ]

    def verify(self) -> bool:
        """Tell whether the certificates show that the region is free, in rational arithmetic.

        The claims are made anew from the robot, the shapes and the region; of the solver
        there are only the numbers that are checked.
        """
        if not self.is_success:
            return False
        problems = PairProblems(self.kinematics, self.plan, self.inspector, self.region)
        return all(
            replace(self.certificates[self.plan.ids(pair)], problem=problems.make(pair)).verify()
            for pair in self.pairs()
        )


def checked_pairs(
    pairs: Iterable[GeometryPair], known: Iterable[GeometryPair]
) -> frozenset[frozenset[int]]:
    """Return known pairs as sets of numbers, in any order. Raises CertificateError for others."""
    given: Any = pairs
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise CertificateError(
            f"ignored_collision_pairs must be pairs of geometries, not {quoted(given)}"
        )
    all_known = {frozenset({int(a), int(b)}) for a, b in known}
    result = set()
    for pair in given:
        each: Any = list(pair) if isinstance(pair, Iterable) else []
        are_ids = all(isinstance(k, GeometryId | numbers.Integral) for k in each)
        both = frozenset(map(int, each)) if are_ids else frozenset()
        if both not in all_known:
            raise CertificateError(f"geometries {quoted(pair)} are no pair that is checked")
        result.add(both)
    return frozenset(result)
