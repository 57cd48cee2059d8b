"""One pair of geometries: from its problem to a certificate, or to why there is none."""

from __future__ import annotations

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.planning.certified.constant_plane import constant_plane
from scene_graph_ros.planning.certified.pair_certificate import LEAST_CLEARANCE, PairCertificate
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.plane_of_many_points import best_plane
from scene_graph_ros.planning.certified.polytope_certificate import PairFailure
from scene_graph_ros.planning.certified.rounding import KEPT_CLEARANCES, rounded
from scene_graph_ros.planning.certified.separation_program import SeparationProgram, Solution

__all__ = ["better_pair", "certified_pair", "first_proof", "proven"]


_SMALL = 1000
"""Monomials of all points' identities: where there are fewer, the best plane is found as soon as
one that does not move."""


def first_proof(
    problem: PairProblem, by: SolverChoice | None = None
) -> PairCertificate | PairFailure:
    """Return a certificate as soon as there is one; of small programs that of the best plane.

    A solver that is chosen solves the whole program.
    """
    if by is not None:
        return certified_pair(problem, by)
    points = (len(side.hull.points) * side.monomials.num_monomials for side in problem.sides)
    found = constant_plane(problem) if sum(points) > _SMALL else None
    return certified_pair(problem) if found is None else found


def better_pair(known: PairCertificate, by: SolverChoice | None = None) -> PairCertificate:
    """Return the certificate of the plane with most clearance, if that is more than is known."""
    found = certified_pair(known.problem, by)
    is_better = isinstance(found, PairCertificate) and found.clearance > known.clearance
    return found if isinstance(found, PairCertificate) and is_better else known


def certified_pair(
    problem: PairProblem, by: SolverChoice | None = None
) -> PairCertificate | PairFailure:
    """Solve a pair's program, by a solver of choice, and prove its answer."""
    try:
        if by is None:
            solution = best_plane(problem)
        else:
            solution = SeparationProgram(problem).maximize_clearance(by)
    except SolverError as error:
        return PairFailure(problem.names, "solver", str(error))
    return proven(problem, solution)


def proven(problem: PairProblem, solution: Solution) -> PairCertificate | PairFailure:
    """Return a certificate of a solution, or why it is none."""
    best = solution.clearance
    if best <= float(LEAST_CLEARANCE):
        return PairFailure(
            problem.names, "no_plane", f"the best clearance of a plane is {best:.3g} m", best
        )
    reason = None
    for share in KEPT_CLEARANCES:
        certificate = rounded(problem, solution, share)
        reason = certificate.failure()
        if reason is None:
            return certificate
    return PairFailure(
        problem.names,
        "rounding",
        f"the clearance {best:.3g} m leaves too little room for rational numbers: {reason}",
        best,
    )
