"""How a configuration space is covered by regions."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from scene_graph_ros.convex.iris.options import IrisOptions
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.regions.arguments import refuse_parameterization
from scene_graph_ros.planning.regions.errors import RegionError
from scene_graph_ros.planning.regions.iris_zo_options import (
    check_counts,
    check_numbers,
    IrisZoOptions,
)
from scene_graph_ros.planning.regions.np_options import IrisNpOptions

__all__ = ["IrisFromCliqueCoverOptions"]


@one_line()
@dataclass(frozen=True, kw_only=True)
class IrisFromCliqueCoverOptions:
    """When a cover is large enough, and how it is looked for.

    Raises RegionError, which names the option and its value.
    """

    iris_options: IrisOptions | IrisZoOptions = field(
        default_factory=lambda: IrisNpOptions(iteration_limit=1)
    )
    """Of each region, an `IrisNpOptions` or `IrisZoOptions`: one ellipsoid is enough, as that of a
    clique tells more than the next one. Their obstacles and constraints hold everywhere."""
    coverage_termination_threshold: float = 0.7
    """Share of the free configurations of the domain that must be covered."""
    iteration_limit: int = 100
    """Rounds of points, their graph and its cliques."""
    num_points_per_coverage_check: int = 5000
    """Points of the domain that the covered share is measured with."""
    parallelism: bool | int = True
    """Threads that check configurations and edges; True takes all processors."""
    minimum_clique_size: int = 3
    """Cliques of fewer points make no region; raised to 1 + nq."""
    num_points_per_visibility_round: int = 200
    """Free points of a round that no region has; raised to twice the size of cliques, and doubled
    after a round without a clique."""
    rank_tol_for_minimum_volume_circumscribed_ellipsoid: float = 1e-6
    """Relative to the largest: below this a singular value of a clique's points does not count."""
    point_in_set_tol: float = 1e-6
    """rad or m: how far outside of a region a point still counts as covered."""

    def __post_init__(self) -> None:
        """Check all values."""
        if not isinstance(self.iris_options, (IrisOptions, IrisZoOptions)):
            raise RegionError(
                "IrisFromCliqueCoverOptions: iris_options must be an IrisNpOptions or"
                f" IrisZoOptions, not {quoted(self.iris_options)}"
            )
        refuse_parameterization(self.iris_options, "IrisFromCliqueCoverOptions")
        least = {
            "iteration_limit": 1,
            "num_points_per_coverage_check": 1,
            "minimum_clique_size": 1,
            "num_points_per_visibility_round": 1,
        }
        check_counts(self, least)
        check_numbers(self, ("coverage_termination_threshold",), 0.0, 1.0)
        tolerances = ("rank_tol_for_minimum_volume_circumscribed_ellipsoid", "point_in_set_tol")
        check_numbers(self, tolerances, 0.0, math.inf, includes=True)
