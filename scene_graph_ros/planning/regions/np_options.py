"""How `iris_in_configuration_space` grows a region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

from scene_graph_ros.convex.iris.options import IrisOptions
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.regions.errors import RegionError
from scene_graph_ros.planning.regions.feasibility import Constraints
from scene_graph_ros.planning.regions.iris_zo_options import check_counts, check_numbers
from scene_graph_ros.planning.regions.parameterization import (
    checked_parameterization,
    IrisParameterizationFunction,
)
from scene_graph_ros.planning.regions.program_constraints import ProgramConstraints

if TYPE_CHECKING:
    from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram

__all__ = ["IrisNpOptions"]


@one_line()
@dataclass(frozen=True, kw_only=True)
class IrisNpOptions(IrisOptions):
    """Those of `iris`, and those that only regions of configurations have.

    Raises RegionError or ConvexSetError, which name the option and its value.
    """

    configuration_space_margin: float = 1e-2
    """rad or m: faces keep away by this from configurations that are not free."""
    num_collision_infeasible_samples: int = 5
    """Rounds of searches in a row that find no configuration that is not free, to be done."""
    configuration_obstacles: Sequence[ConvexSet] = ()
    """Convex sets of configurations that are not free."""
    additional_constraints: Constraints | None = None
    """Of configurations ``(n, nq)`` returns ``(n, k)``: all at most 0 where free."""
    prog_with_additional_constraints: NonlinearProgram | None = None
    """The same as a program whose variables are a configuration; its costs do not count."""
    num_additional_constraint_infeasible_samples: int = 5
    """The same for constraints, where there are some; the larger of the two counts."""
    random_seed: int = 1234
    """The same seed gives the same region."""
    mixing_steps: int = 10
    """Steps of hit and run to each new point."""
    parallelism: bool | int = True
    """Threads that check configurations; True takes all processors."""
    num_test_samples: int = 1000
    """Points of the region, never used for faces, of which the record is."""
    parameterization: IrisParameterizationFunction | None = None
    """A function of a region's points with its derivatives: the region is one of these points,
    and so are the domain, which is needed, the sample and ``starting_ellipse``. It is for one
    region alone."""

    def __post_init__(self) -> None:
        """Check all values."""
        super().__post_init__()
        least = {
            "num_collision_infeasible_samples": 1,
            "num_additional_constraint_infeasible_samples": 1,
            "random_seed": 0,
            "mixing_steps": 1,
            "num_test_samples": 1,
        }
        check_counts(self, least)
        check_numbers(self, ("configuration_space_margin",), 0.0, math.inf, includes=True)
        function = checked_parameterization(self.parameterization, "IrisNpOptions")
        if function is not None and not function.has_jacobian:
            raise RegionError(
                "IrisNpOptions: parameterization must have derivatives, as counter-examples are"
                " looked for along gradients; give IrisParameterizationFunction a jacobian, or"
                " use iris_zo"
            )
        program = self.prog_with_additional_constraints
        if program is None:
            return
        made = self.additional_constraints
        # As `dataclasses.replace` gives it back.
        if not isinstance(made, ProgramConstraints) or made.program is not program:
            if made is not None:
                raise RegionError(
                    "IrisNpOptions: give one of additional_constraints and"
                    " prog_with_additional_constraints"
                )
            object.__setattr__(self, "additional_constraints", ProgramConstraints(program))

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for a worker: constraints as a function, as a program can't be sent."""
        return {**self.__dict__, "prog_with_additional_constraints": None}
