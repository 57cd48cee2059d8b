"""A collision checker without collisions, to derive from."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NoReturn

from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.planning.checker.checker_interface import CollisionChecker
from scene_graph_ros.planning.checker.checker_state import make_state
from scene_graph_ros.planning.checker.distance_and_interpolation import (
    ConfigurationDistanceFunction,
    DistanceAndInterpolationProvider,
)
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram

__all__ = ["UnimplementedCollisionChecker"]


class UnimplementedCollisionChecker(CollisionChecker):
    """Raises NotImplementedError wherever a kind of checker has to answer.

    Bodies, shapes, paddings, filters, distances, ways and contexts are there. A class derived from
    it has the questions that it answers, and those that follow from them.
    """

    def __init__(
        self,
        *,
        model: RobotDiagram,
        supports_parallel_checking: bool,
        robot_model_instances: Iterable[str] | None = None,
        edge_step_size: float = 0.05,
        env_collision_padding: float = 0.0,
        self_collision_padding: float = 0.0,
        distance_and_interpolation_provider: DistanceAndInterpolationProvider | None = None,
        configuration_distance_function: ConfigurationDistanceFunction | None = None,
        implicit_context_parallelism: int | None = None,
        require_homogeneous_filters: bool = False,
    ) -> None:
        """Take the parameters of all checkers. Raises CollisionCheckerError naming the field."""
        state = make_state(model, model.context.snapshot, robot_model_instances)
        super().__init__(
            model,
            state.padded(env_collision_padding, self_collision_padding),
            edge_step_size=edge_step_size,
            distance_and_interpolation_provider=distance_and_interpolation_provider,
            configuration_distance_function=configuration_distance_function,
            implicit_context_parallelism=implicit_context_parallelism,
            require_homogeneous_filters=require_homogeneous_filters,
            supports_parallel_checking=supports_parallel_checking,
        )

    def check_configs_collision_free(
        self, configurations: ArrayLike, *, threads: int = 1
    ) -> NDArray[Any]:
        """Raise NotImplementedError."""
        self._unimplemented("check_configs_collision_free")

    def measure_edges(self, edges: ArrayLike, *, threads: int = 1) -> list[Any]:
        """Raise NotImplementedError; nothing is proven by samples."""
        self._unimplemented("measure_edges")

    def calc_robot_clearance(self, q: ArrayLike, influence_distance: float) -> Any:
        """Raise NotImplementedError."""
        self._unimplemented("calc_robot_clearance")

    def classify_body_collisions(self, q: ArrayLike) -> list[Any]:
        """Raise NotImplementedError."""
        self._unimplemented("classify_body_collisions")

    def max_num_distances(self) -> int:
        """Raise NotImplementedError."""
        self._unimplemented("max_num_distances")

    def _unimplemented(self, method: str) -> NoReturn:
        raise NotImplementedError(f"{type(self).__name__} does not implement {method}")
