"""The parameters of collision checkers, as one value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.checker.distance_and_interpolation import (
    ConfigurationDistanceFunction,
    DistanceAndInterpolationProvider,
)
from scene_graph_ros.planning.checker.homogeneous_filters import as_switch
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram
from scene_graph_ros.planning.errors import CollisionCheckerError, finite_number

__all__ = ["CollisionCheckerParams"]


@one_line()
@dataclass(frozen=True, eq=False, kw_only=True)
class CollisionCheckerParams:
    """Parameters for `CollisionChecker.from_params`.

    Paddings are in m, ``edge_step_size`` in the unit of the distance of configurations. At most
    one of a provider and a distance function is given; the linear provider is used without.
    Without ``implicit_context_parallelism`` each processor has a context. Raises
    CollisionCheckerError naming the field and its value.
    """

    model: RobotDiagram
    robot_model_instances: Sequence[str]
    """The names of the robots that it is for, one at least."""
    edge_step_size: float
    env_collision_padding: float = 0.0
    self_collision_padding: float = 0.0
    distance_and_interpolation_provider: DistanceAndInterpolationProvider | None = None
    configuration_distance_function: ConfigurationDistanceFunction | None = None
    implicit_context_parallelism: int | None = None
    require_homogeneous_filters: bool = False
    """Whether to refuse a scene that filters some geometries of two bodies, and others not."""

    def __post_init__(self) -> None:
        """Check all that needs no checker."""
        model: Any = self.model
        if not isinstance(model, RobotDiagram):
            raise CollisionCheckerError(f"model must be a RobotDiagram, not {quoted(self.model)}")
        names: Any = self.robot_model_instances
        if isinstance(names, str) or not isinstance(names, Sequence) or not names:
            raise CollisionCheckerError(
                f"robot_model_instances must be names, one at least, not {quoted(names)}"
            )
        if finite_number("edge_step_size", self.edge_step_size) <= 0.0:
            raise CollisionCheckerError(
                f"edge_step_size must be positive, not {quoted(self.edge_step_size)}"
            )
        for field in ("env_collision_padding", "self_collision_padding"):
            finite_number(field, getattr(self, field))
        as_switch(self.require_homogeneous_filters)
        if None not in (
            self.distance_and_interpolation_provider,
            self.configuration_distance_function,
        ):
            raise CollisionCheckerError(
                "only one of distance_and_interpolation_provider and"
                " configuration_distance_function may be given"
            )
