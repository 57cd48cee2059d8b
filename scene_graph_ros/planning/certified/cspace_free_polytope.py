"""Polytopes of configurations that are free of collisions, by planes between geometries.

Dai, Amice, Werner, Zhang and Tedrake, "Certified polyhedral decompositions of collision-free
configuration space", 2023 (C-IRIS).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.certified.bilinear_alternation import alternate
from scene_graph_ros.planning.certified.distance_certificate import (
    DistanceCertificate,
    RegionGrid,
)
from scene_graph_ros.planning.certified.distance_search import checked_max_boxes, search_boxes
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.pair_certificate import PairCertificate
from scene_graph_ros.planning.certified.pair_problem import PairProblems
from scene_graph_ros.planning.certified.pair_search import better_pair, certified_pair, first_proof
from scene_graph_ros.planning.certified.polytope_certificate import (
    checked_pairs,
    GeometryPair,
    PairFailure,
    PolytopeCertificate,
)
from scene_graph_ros.planning.certified.rational_kinematics import RationalForwardKinematics
from scene_graph_ros.planning.certified.search_options import (
    as_given_polytope,
    as_search_options,
    BilinearAlternationOptions,
    BinarySearchOptions,
    FindSeparationCertificateOptions,
)
from scene_graph_ros.planning.certified.separating_planes import (
    CSpaceSeparatingPlane,
    separating_planes,
)
from scene_graph_ros.planning.certified.separation_certificate_program import (
    SeparationCertificateProgram,
)
from scene_graph_ros.planning.certified.tangent_region import (
    checked_rows,
    make_region,
    TangentRegion,
)
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.configuration_checks import first_pairs
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.parallel.in_executor import (
    AnyExecutor,
    checked_executor,
    in_executor,
)

__all__ = ["CspaceFreePolytope"]

_SAMPLES = 256
"""Points of a region that are looked at before anything is solved."""


@one_line()
class CspaceFreePolytope:
    """Searches for polytopes of s = tan((q - q_star) / 2) in which robots collide with nothing.

    Pairs, paddings and filters are the checker's when this is made. Joints may be revolute and
    prismatic (for which s is q - q_star), shapes boxes, spheres, capsules, cylinders (as prisms
    with eight sides around them) and convex meshes.
    """

    def __init__(
        self, checker: SceneGraphCollisionChecker, q_star: ArrayLike | None = None
    ) -> None:
        """Take s = 0 at ``q_star`` ``(nq,)``; without, at zero.

        Raises CertificateError for another checker and other joints.
        """
        if not isinstance(checker, SceneGraphCollisionChecker):
            raise CertificateError(
                f"checker must be a SceneGraphCollisionChecker, not {quoted(checker)}"
            )
        self._checker = checker.clone()
        self._plan, self._inspector = checker.plan, checker.snapshot.inspector
        self._kinematics = RationalForwardKinematics(self._plan.tree, q_star)
        self._touching_first: tuple[int, ...] = ()

    @property
    def rational_forward_kinematics(self) -> RationalForwardKinematics:
        """The map between q and s."""
        return self._kinematics

    @property
    def geometry_pairs(self) -> tuple[GeometryPair, ...]:
        """The pairs of geometry ids that need a plane."""
        return tuple(self._plan.ids(pair) for pair in range(len(self._plan.pairs.bodies)))

    @property
    def separating_planes(self) -> tuple[CSpaceSeparatingPlane, ...]:
        """The plane that is to be between each pair; certificates say which is whose."""
        return separating_planes(self._checker, self._kinematics)

    @property
    def map_geometries_to_separating_planes(self) -> dict[GeometryPair, int]:
        """Which of `separating_planes` is between two geometries, by their ids."""
        return {pair: index for index, pair in enumerate(self.geometry_pairs)}

    def find_separation_certificate_given_polytope(
        self,
        C: ArrayLike,
        d: ArrayLike,
        ignored_collision_pairs: Iterable[GeometryPair] = (),
        options: FindSeparationCertificateOptions | None = None,
        *,
        terminate_at_failure: bool = True,
        most_clearance: bool = True,
        executor: AnyExecutor | None = None,
    ) -> PolytopeCertificate:
        """Return a certificate of ``{s: C s <= d}``, ``(m, nq)`` and ``(m,)``, within limits.

        These are the joints'; s are tangents of half angles, and metres. A success is a proof,
        checked in rational arithmetic; anything else is none, and its ``failures`` say which pair
        and why. Some of the region's points are tried first: where one collides, no program is
        solved. Pairs are shared out among the workers of an ``executor``; otherwise the search
        ends at the first failure unless ``terminate_at_failure`` is False.

        Of many joints and points planes that do not move are tried first. Then, with
        ``most_clearance``, the pairs that keep least get the planes that keep most, which costs
        most of the time there. ``options`` has both switches, too: each is off where either says
        so.

        Raises CertificateError for a polytope that is empty, flat or unbounded, numbers that are
        not finite, pairs that are not checked, and shapes that have no planes.
        """
        chosen = as_given_polytope(options)
        region = make_region(self._kinematics, C, d)
        if chosen.ignore_redundant_C:
            region = region.without_redundant_rows()
        ignored = self._ignored(ignored_collision_pairs)
        chosen = replace(
            chosen, terminate_at_failure=chosen.terminate_at_failure and terminate_at_failure
        )
        found = self._certify(region, ignored, chosen, checked_executor(executor))
        is_best = chosen.most_clearance and most_clearance
        return _with_most_clearance(found, chosen.solver) if is_best else found

    def find_pair_certificate(
        self, geometry_pair: GeometryPair, C: ArrayLike, d: ArrayLike
    ) -> PairCertificate | PairFailure:
        """Return the certificate of one pair in ``{s: C s <= d}``. Raises CertificateError."""
        return self.solve_separation_certificate_program(
            self.make_is_geometry_separable_program(geometry_pair, C, d)
        )

    def make_is_geometry_separable_program(
        self, geometry_pair: GeometryPair, C: ArrayLike, d: ArrayLike
    ) -> SeparationCertificateProgram:
        """Return the program that looks for a plane between a pair in ``{s: C s <= d}``.

        Raises CertificateError as `find_separation_certificate_given_polytope`.
        """
        (ids,) = self._ignored([geometry_pair])
        pair = self._plan.pair_of(*ids)
        assert pair is not None  # as it is a pair that is checked
        region = make_region(self._kinematics, C, d)
        return SeparationCertificateProgram(self._problems(region).make(pair))

    def solve_separation_certificate_program(
        self,
        certificate_program: SeparationCertificateProgram,
        options: FindSeparationCertificateOptions | None = None,
    ) -> PairCertificate | PairFailure:
        """Return a program's certificate, proven in rational numbers, or the reason for none.

        Rows and costs that were added to its `prog` have no part in it: solve that by itself.
        Raises CertificateError for other arguments.
        """
        if not isinstance(certificate_program, SeparationCertificateProgram):
            raise CertificateError(
                "certificate_program must be a SeparationCertificateProgram, not"
                f" {quoted(certificate_program)}"
            )
        return certified_pair(certificate_program.problem, as_given_polytope(options).solver)

    def certify_by_distances(
        self, C: ArrayLike, d: ArrayLike, *, max_boxes: int = 1_000_000, threads: int = 1
    ) -> DistanceCertificate:
        """Return a certificate by distances of ``{s: C s <= d}`` within the joints' limits.

        No program is solved: see the function of this name, which is about regions of q. Raises
        as it.
        """
        grid = RegionGrid(make_region(self._kinematics, C, d), self._kinematics)
        return search_boxes(self._checker, grid, checked_max_boxes(max_boxes), threads)

    def binary_search(
        self,
        C: ArrayLike,
        d: ArrayLike,
        s_center: ArrayLike,
        ignored_collision_pairs: Iterable[GeometryPair] = (),
        options: BinarySearchOptions | None = None,
        *,
        executor: AnyExecutor | None = None,
    ) -> PolytopeCertificate | None:
        """Return the proof of the largest polytope found by scaling one about a point of it.

        The polytope at the scale t is ``C s <= C s_center + t (d - C s_center)``. None where that
        at ``scale_min`` is not proven. Raises as `find_separation_certificate_given_polytope`, and
        for a centre that is not inside.
        """
        chosen = as_search_options(options, BinarySearchOptions)
        make_region(self._kinematics, C, d)
        rows, sides = checked_rows(C, d, len(self._kinematics.s_limits()[0]))
        center = self._checked_inside(s_center, rows, sides, "s_center")
        pairs: Any = self._ignored(ignored_collision_pairs)

        def at(scale: float) -> PolytopeCertificate:
            height = rows @ center
            return self.find_separation_certificate_given_polytope(
                rows,
                height + scale * (sides - height),
                pairs,
                chosen.find_lagrangian_options,
                most_clearance=False,
                executor=executor,
            )

        solver = chosen.find_lagrangian_options.solver
        found = at(chosen.scale_max)
        if found.is_success:
            return _with_most_clearance(found, solver)
        best = at(chosen.scale_min)
        if not best.is_success:
            return None
        low, high = chosen.scale_min, chosen.scale_max
        rounds = 0
        while rounds < chosen.max_iter and high - low > chosen.convergence_tol:
            rounds += 1
            middle = 0.5 * (low + high)
            found = at(middle)
            if found.is_success:
                low, best = middle, found
            else:
                high = middle
        return replace(_with_most_clearance(best, solver), num_iter=rounds)

    def search_with_bilinear_alternation(
        self,
        C_init: ArrayLike,
        d_init: ArrayLike,
        ignored_collision_pairs: Iterable[GeometryPair] = (),
        options: BilinearAlternationOptions | None = None,
        *,
        executor: AnyExecutor | None = None,
    ) -> list[PolytopeCertificate]:
        """Return proofs of polytopes that grow, the largest last, from ``C_init s <= d_init`` on.

        In each round planes are found for the polytope, then its faces, in place and direction,
        for their multipliers, so that the largest ellipsoid inside stays there and has the most
        room. Each polytope is proven; where the first is not, the list is empty. Raises
        as `find_separation_certificate_given_polytope`, and for ``s_inner_pts`` that are outside.
        """
        chosen = as_search_options(options, BilinearAlternationOptions)
        workers = checked_executor(executor)
        ignored = self._ignored(ignored_collision_pairs)
        region = make_region(self._kinematics, C_init, d_init)
        rows, sides = checked_rows(C_init, d_init, len(region.lower))
        for number, point in enumerate(chosen.faces.s_inner_pts):
            self._checked_inside(point, rows, sides, f"s_inner_pts[{number}]")
        search = as_given_polytope(chosen.find_lagrangian_options)
        search = replace(search, terminate_at_failure=True)
        start = self._certify(region, ignored, search, workers)
        if not start.is_success:
            return []

        def certify(region: TangentRegion) -> PolytopeCertificate:
            return self._certify(region, ignored, search, workers)

        found = alternate(start, self._kinematics.s_limits(), certify, chosen)
        return [_with_most_clearance(each, search.solver) for each in found]

    def _problems(self, region: TangentRegion) -> PairProblems:
        return PairProblems(self._kinematics, self._plan, self._inspector, region)

    def _certify(
        self,
        region: TangentRegion,
        ignored: frozenset[frozenset[int]],
        options: FindSeparationCertificateOptions,
        executor: AnyExecutor | None,
    ) -> PolytopeCertificate:
        certificates: dict[GeometryPair, PairCertificate] = {}
        failures: dict[GeometryPair, PairFailure] = {}
        result = PolytopeCertificate(
            self._kinematics,
            self._plan,
            self._inspector,
            region,
            certificates,
            failures,
            ignored,
        )
        pairs = result.pairs()
        witness = self._witness(region, pairs)
        if witness is not None:
            ids, failure = witness
            failures[ids] = failure
            return result
        # What failed last is likely to fail again.
        pairs.sort(key=lambda pair: pair not in self._touching_first)
        problems = self._problems(region)
        batches = [pairs] if executor is not None else [[pair] for pair in pairs]
        for batch in batches:
            shares = [(problems.make(pair), options.solver) for pair in batch]
            for pair, found in zip(batch, in_executor(first_proof, shares, executor), strict=True):
                if isinstance(found, PairCertificate):
                    certificates[self._plan.ids(pair)] = found
                else:
                    failures[self._plan.ids(pair)] = found
                    self._touching_first = (pair,)
            if failures and options.terminate_at_failure:
                break
        return result

    def _witness(
        self, region: TangentRegion, pairs: list[int]
    ) -> tuple[GeometryPair, PairFailure] | None:
        """Return a pair that collides at a point of the region, if one of some points does."""
        points = _spread(region)
        chosen = self._plan.with_rows(np.array(pairs, dtype=np.int64))
        if not pairs or not len(points):
            return None
        q = self._kinematics.compute_q_value(points)
        first = first_pairs(chosen, q, 1)
        rows = np.flatnonzero(first != NO_PAIR)
        if not len(rows):
            return None
        ids = chosen.ids(int(first[rows[0]]))
        names = tuple(str(self._inspector.get_name(each)) for each in ids)
        at = q[rows[0]]
        reason = f"they collide at {np.array2string(at, precision=4)}"
        return ids, PairFailure((names[0], names[1]), "collision", reason, q=at)

    def _ignored(self, pairs: Iterable[GeometryPair]) -> frozenset[frozenset[int]]:
        return checked_pairs(pairs, self.geometry_pairs)

    def _checked_inside(
        self, point: ArrayLike, C: NDArray[np.float64], d: NDArray[np.float64], label: str
    ) -> NDArray[np.float64]:
        lower, upper = self._kinematics.s_limits()
        rule = f"{label} must be {len(lower)} finite numbers"
        s = real_array(point, rule, CertificateError)
        if s.shape != lower.shape or not np.isfinite(s).all():
            raise CertificateError(f"{rule}, not {quoted(point)}")
        if (C @ s > d).any() or (s < lower).any() or (s > upper).any():
            raise CertificateError(
                f"{label} must be in the polytope and within the joints' limits: {quoted(point)}"
            )
        return s


def _with_most_clearance(
    found: PolytopeCertificate, by: SolverChoice | None
) -> PolytopeCertificate:
    """Return better certificates of the pairs that keep least, until others keep no more."""
    certificates = dict(found.certificates)
    settled = set()
    while certificates and found.is_success:
        least = min(certificates, key=lambda pair: certificates[pair].clearance)
        if least in settled:
            break
        certificates[least] = better_pair(certificates[least], by)
        settled.add(least)
    return replace(found, certificates=certificates)


def _spread(region: TangentRegion) -> NDArray[Any]:
    """Return some points of a region: corners of its bounds, and points all over it."""
    n = len(region.lower)
    generator = np.random.default_rng(1)
    shares = generator.uniform(size=(4 * _SAMPLES, n))
    if n <= 8:
        corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * n, indexing="ij")).reshape(n, -1).T
        shares = np.concatenate([np.full((1, n), 0.5), corners, shares])
    points = region.lower + shares * (region.upper - region.lower)
    return points[region.contains(points)][:_SAMPLES]
