"""How `iris_zo` grows a region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
import numbers
from typing import Any

from numpy.typing import ArrayLike

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.regions.errors import RegionError
from scene_graph_ros.planning.regions.feasibility import Constraints
from scene_graph_ros.planning.regions.parameterization import (
    checked_parameterization,
    IrisParameterizationFunction,
    PointFunction,
)

__all__ = ["IrisZoOptions", "check_counts", "check_numbers"]


@one_line()
@dataclass(frozen=True, kw_only=True)
class IrisZoOptions:
    """When a region counts as free, and how it is looked for.

    With probability ``1 - delta`` its share that is not free is at most ``epsilon``. Raises
    RegionError, which names the option and its value.
    """

    containment_points: ArrayLike | None = None
    """``(k, nq)``: points that stay inside, whose hull must be free and hold the centre. Where
    they are nearer to an obstacle than the margin, the margin gives way."""
    num_particles: int = 1000
    """Points of a round that faces are made of, at most; those of them that are not free."""
    tau: float = 0.5
    """Of the test, between 0 and 1: a region passes with ``(1 - tau) epsilon`` of its points not
    free. A larger one needs fewer points, and lets fewer good regions pass."""
    delta: float = 0.05
    """Probability that the share which is not free is above ``epsilon``, for all tests at once."""
    epsilon: float = 0.01
    """Share of the region that may be not free."""
    max_iterations: int = 3
    """Ellipsoids: each is the largest in the region before."""
    max_iterations_separating_planes: int = 20
    """Rounds of faces for an ellipsoid."""
    max_separating_planes_per_iteration: int = -1
    """Faces of a round; -1: as many as there are."""
    bisection_steps: int = 10
    """Halvings of the way from the centre to a point, to find where it is not free any more."""
    parallelism: bool | int = True
    """Threads that check configurations; True takes all processors."""
    verbose: bool = False
    """Print a line for each round."""
    require_sample_point_is_contained: bool = True
    """Keep the centre of the starting ellipsoid inside, as one of ``containment_points``."""
    configuration_space_margin: float = 1e-2
    """rad or m: faces keep away by this from points that are not free."""
    termination_threshold: float = 2e-2
    """End where the ellipsoid's volume grows by no more; not if negative."""
    relative_termination_threshold: float = 1e-3
    """End where it grows by no more than this share of the best so far; not if negative."""
    random_seed: int = 1234
    """The same seed gives the same region."""
    mixing_steps: int = 50
    """Steps of hit and run to each new point."""
    configuration_obstacles: Sequence[ConvexSet] = ()
    """Convex sets of configurations that are not free."""
    additional_constraints: Constraints | None = None
    """A function of configurations ``(n, nq)`` that returns ``(n, k)``: all at most 0 where free.
    It may be called in any thread."""
    parameterization: IrisParameterizationFunction | PointFunction | None = None
    """A function of a region's points ``(n, k)`` that returns configurations ``(n, nq)``: the
    region is one of these points. It is for one region alone."""
    remove_all_collisions_possible: bool = False
    """Whether a region that passed its test is cut at the test's points that are not free, and
    tested anew, until a test has none or no rounds are left."""

    def __post_init__(self) -> None:
        """Check all values."""
        checked_parameterization(self.parameterization, "IrisZoOptions")
        if not isinstance(self.remove_all_collisions_possible, bool):
            raise RegionError(
                "IrisZoOptions: remove_all_collisions_possible must be True or False, not"
                f" {quoted(self.remove_all_collisions_possible)}"
            )
        least = {
            "num_particles": 1,
            "max_iterations": 1,
            "max_iterations_separating_planes": 1,
            "max_separating_planes_per_iteration": -1,
            "bisection_steps": 0,
            "random_seed": 0,
            "mixing_steps": 1,
        }
        check_counts(self, least)
        if self.max_separating_planes_per_iteration == 0:
            raise RegionError("IrisZoOptions: max_separating_planes_per_iteration must not be 0")
        inside = ("tau", "delta", "epsilon")
        check_numbers(self, inside, 0.0, 1.0)
        check_numbers(self, ("configuration_space_margin",), 0.0, math.inf, includes=True)
        for name in ("termination_threshold", "relative_termination_threshold"):
            check_numbers(self, (name,), -math.inf, math.inf)


def check_counts(options: Any, least: dict[str, int]) -> None:
    """Raise RegionError unless options are whole numbers of at least so much."""
    for name, low in least.items():
        value = getattr(options, name)
        is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
        if not is_whole or value < low:
            raise RegionError(
                f"{type(options).__name__}: {name} must be a whole number, at least {low}, not"
                f" {quoted(value)}"
            )


def check_numbers(
    options: Any, names: Sequence[str], low: float, high: float, *, includes: bool = False
) -> None:
    """Raise RegionError unless options are numbers between two, with the lower one or without."""
    for name in names:
        value = as_float(getattr(options, name))
        if value is None or not (low < value < high or (includes and value == low)):
            between = "at least" if includes else "above"
            raise RegionError(
                f"{type(options).__name__}: {name} must be a number {between} {low:g} and below"
                f" {high:g}, not {quoted(getattr(options, name))}"
            )
