"""One pair of geometries: from its problem to a certificate, or to why there is none."""

from __future__ import annotations

from scene_graph_ros.geometry.optimization.errors import SolverError
from scene_graph_ros.planning.certified.pair_certificate import LEAST_CLEARANCE, PairCertificate
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.plane_search import most_clearance
from scene_graph_ros.planning.certified.polytope_certificate import PairFailure
from scene_graph_ros.planning.certified.rounding import KEPT_CLEARANCES, rounded
from scene_graph_ros.planning.certified.separation_program import Solution

__all__ = ["certified_pair", "proven"]


def certified_pair(problem: PairProblem) -> PairCertificate | PairFailure:
    """Solve a pair's program and prove what it says."""
    try:
        solution = most_clearance(problem)
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
