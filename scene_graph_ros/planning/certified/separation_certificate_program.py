"""The program of one pair as a value, to be solved for its plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from scene_graph_ros.convex.solve.cones.cone_program import ConeProgram
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.certified.pair_problem import PairProblem
from scene_graph_ros.planning.certified.separation_program import SeparationProgram

__all__ = ["SeparationCertificateProgram"]


@one_line()
@dataclass(frozen=True, eq=False)
class SeparationCertificateProgram:
    """A search for a plane between a pair in a polytope: sums of squares, with most clearance.

    ``certificate`` has where the plane's coefficients and the Gram matrices of all multipliers are
    among the variables of ``prog``.
    """

    problem: PairProblem

    @property
    def plane_index(self) -> int:
        """Which of `CspaceFreePolytope.separating_planes` it is about."""
        return self.problem.plane_index

    @cached_property
    def certificate(self) -> SeparationProgram:
        """Its variables: ``plane``, ``clearance``, ``normal_grams`` and, by side, ``grams``."""
        found = SeparationProgram(self.problem)
        found.ask_for_clearance()
        return found

    @property
    def prog(self) -> ConeProgram:
        """The program over cones, of its own: `certificate.solution` reads a solution of it."""
        return self.certificate.program
