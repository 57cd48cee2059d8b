"""The interface of all collision checkers, also with another notion of collision."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.changing_checker import ChangingChecker
from scene_graph_ros.planning.checker.checker_contexts import (
    checked_parallelism,
    CheckerContexts,
    CollisionCheckerContext,
)
from scene_graph_ros.planning.checker.checker_state import CheckerState
from scene_graph_ros.planning.checker.collision_checker_params import CollisionCheckerParams
from scene_graph_ros.planning.checker.distance_and_interpolation import (
    ConfigurationDistanceFunction,
    DistanceAndInterpolationProvider,
)
from scene_graph_ros.planning.checker.homogeneous_filters import (
    as_switch,
    demand_homogeneous_filters,
)
from scene_graph_ros.planning.checker.measuring_checker import MeasuringChecker
from scene_graph_ros.planning.checker.robot_clearance import RobotClearance, RobotCollisionType
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram
from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["CollisionChecker", "one_configuration", "one_edge"]

Self = TypeVar("Self", bound="CollisionChecker")


@one_line("robot_model_instances")
class CollisionChecker(ChangingChecker, MeasuringChecker, ABC):
    """Answers about configurations ``(nq,)`` of the robots of a scene, and edges between them.

    A derived class decides collisions, by ``check_configs_collision_free``. Edges are then
    sampled at ``edge_step_size``, which proves nothing between the samples; the scene's own
    checker proves them instead. ``threads=`` shares batches out, if it supports parallel checking.
    """

    def __init__(
        self,
        model: RobotDiagram,
        state: CheckerState,
        *,
        edge_step_size: float,
        distance_and_interpolation_provider: DistanceAndInterpolationProvider | None,
        configuration_distance_function: ConfigurationDistanceFunction | None,
        implicit_context_parallelism: int | None,
        require_homogeneous_filters: bool,
        supports_parallel_checking: bool,
    ) -> None:
        self._model, self._tree = model, model.tree
        if as_switch(require_homogeneous_filters):
            demand_homogeneous_filters(state)
        ChangingChecker.__init__(self, state)
        MeasuringChecker.__init__(
            self,
            model.tree,
            edge_step_size=edge_step_size,
            distance_and_interpolation_provider=distance_and_interpolation_provider,
            configuration_distance_function=configuration_distance_function,
        )
        self._supports_parallel_checking = bool(supports_parallel_checking)
        count = checked_parallelism(implicit_context_parallelism, bool(supports_parallel_checking))
        self._contexts = CheckerContexts(count, lambda: self._state)

    @classmethod
    def from_params(cls: type[Self], params: CollisionCheckerParams, **more: Any) -> Self:
        """Return a checker of parameters, and those that only this kind of checker has."""
        return cls(**vars(params), **more)

    def clone(self: Self) -> Self:
        """Return a checker of its own, with contexts of its own."""
        result = super().clone()
        result._contexts = CheckerContexts(self._contexts.count, lambda: result._state)
        return result

    @property
    def model(self) -> RobotDiagram:
        """The robots and their scene."""
        return self._model

    @property
    def robot_model_instances(self) -> tuple[str, ...]:
        """The names of the robots' sources, sorted."""
        links = set(self._model.frames.values())
        own = (b for b in self.bodies if b.frame_id in links and self.is_part_of_robot(b))
        return tuple(sorted({body.model_instance_name for body in own}))

    def get_zero_configuration(self) -> NDArray[np.float64]:
        """Return positions ``(nq,)`` of zero; quaternions are those of no turn."""
        return self._tree.zero_configuration()

    def supports_parallel_checking(self) -> bool:
        """Tell whether threads may share the work."""
        return self._supports_parallel_checking

    # What a kind of checker has to answer.

    @abstractmethod
    def check_configs_collision_free(
        self, configurations: ArrayLike, *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell of each configuration ``(n, nq)`` whether it is free."""

    @abstractmethod
    def measure_edges(self, edges: ArrayLike, *, threads: int = 1) -> list[EdgeMeasure]:
        """Return a measure of each edge ``(n, 2, nq)``: the part that is proven free."""

    @abstractmethod
    def calc_robot_clearance(self, q: ArrayLike, influence_distance: float) -> RobotClearance:
        """Return padded distances at q ``(nq,)`` up to a distance (m), and their derivatives."""

    @abstractmethod
    def classify_body_collisions(self, q: ArrayLike) -> list[RobotCollisionType]:
        """Return the type of each body's collisions at q ``(nq,)``, in the bodies' order."""

    @abstractmethod
    def max_num_distances(self) -> int:
        """Return the largest number of rows of `calc_robot_clearance`."""

    # What follows from that.

    def check_config_collision_free(self, q: ArrayLike) -> bool:
        """Tell whether q ``(nq,)`` is free.

        Raises KinematicTreeError for another shape and values that are not finite.
        """
        checked = self._tree.checked_configurations(one_configuration("q", q))
        return bool(self.check_configs_collision_free(checked)[0])

    def check_edges_collision_free(
        self, edges: ArrayLike, *, threads: int = 1
    ) -> NDArray[np.bool_]:
        """Tell of each edge ``(n, 2, nq)`` whether it is free; here that its samples are."""
        return self.check_edges_by_samples(edges, threads=threads)

    def check_edges_by_samples(self, edges: ArrayLike, *, threads: int = 1) -> NDArray[np.bool_]:
        """Tell of each edge ``(n, 2, nq)`` whether its samples are free, both ends included.

        They are at steps of ``edge_step_size``; nothing is known of the edges in between. Raises
        CollisionCheckerError for another shape.
        """
        ends = real_array(edges, "edges must be numbers", CollisionCheckerError)
        nq = self._tree.num_positions
        if ends.ndim != 3 or ends.shape[1:] != (2, nq):
            raise CollisionCheckerError(f"edges must have shape (n, 2, {nq}), not {ends.shape}")
        free = np.empty(len(ends), dtype=np.bool_)
        for row, (q1, q2) in enumerate(ends):
            samples = self.samples(q1, q2)
            free[row] = self.check_configs_collision_free(samples, threads=threads).all()
        return free

    def check_edge_collision_free(self, q1: ArrayLike, q2: ArrayLike) -> bool:
        """Tell whether the edge between two configurations ``(nq,)`` is free."""
        return bool(self.check_edges_collision_free(one_edge(q1, q2))[0])

    def measure_edge(self, q1: ArrayLike, q2: ArrayLike) -> EdgeMeasure:
        """Return the proven part of the edge from q1 to q2 ``(nq,)`` and its obstacle."""
        return self.measure_edges(one_edge(q1, q2))[0]

    # The same by the reference's names.

    def check_edge_collision_free_parallel(
        self, q1: ArrayLike, q2: ArrayLike, *, threads: int = 1
    ) -> bool:
        """Tell it as `check_edge_collision_free`; threads share the pieces of a provider's way."""
        return bool(self.check_edges_collision_free(one_edge(q1, q2), threads=threads)[0])

    def measure_edge_collision_free(self, q1: ArrayLike, q2: ArrayLike) -> EdgeMeasure:
        """Return the same as `measure_edge`."""
        return self.measure_edge(q1, q2)

    def measure_edge_collision_free_parallel(
        self, q1: ArrayLike, q2: ArrayLike, *, threads: int = 1
    ) -> EdgeMeasure:
        """Return the same as `measure_edge`; threads share the pieces of a provider's curve."""
        return self.measure_edges(one_edge(q1, q2), threads=threads)[0]

    def measure_edges_collision_free(
        self, edges: ArrayLike, *, threads: int = 1
    ) -> list[EdgeMeasure]:
        """Return the same as `measure_edges`."""
        return self.measure_edges(edges, threads=threads)

    def measure_context_edge_collision_free(
        self, model_context: CollisionCheckerContext, q1: ArrayLike, q2: ArrayLike
    ) -> EdgeMeasure:
        """Return the same as `measure_context_edge`."""
        return self.measure_context_edge(model_context, q1, q2)

    # Contexts. CollisionCheckerError is raised for one that is not this checker's own.

    @property
    def num_allocated_contexts(self) -> int:
        """How many contexts have a number."""
        return self._contexts.count

    def model_context(self, context_number: int | None = None) -> CollisionCheckerContext:
        """Return a context by its number, the first without; raises for one that there is not."""
        return self._contexts.numbered(context_number)

    def make_standalone_model_context(self) -> CollisionCheckerContext:
        """Return a context for a thread of one's own."""
        return self._contexts.make_standalone()

    def perform_operation_against_all_model_contexts(
        self, operation: Callable[[RobotDiagram, CollisionCheckerContext], object]
    ) -> None:
        """Call ``operation(model, context)`` for each context with a number or still in use."""
        for context in self._contexts.all():
            operation(self._model, context)

    def update_positions(
        self, q: ArrayLike, context_number: int | None = None
    ) -> CollisionCheckerContext:
        """Set the positions ``(nq,)`` of a context with a number; return it."""
        return self.update_context_positions(self.model_context(context_number), q)

    def update_context_positions(
        self, model_context: CollisionCheckerContext, q: ArrayLike
    ) -> CollisionCheckerContext:
        """Set the positions ``(nq,)`` of a context; return it. Raises as all here for no own."""
        context = self._contexts.own(model_context)
        context.set_positions(one_configuration("q", q)[0])
        return context

    def check_context_config_collision_free(
        self, model_context: CollisionCheckerContext, q: ArrayLike
    ) -> bool:
        """Set a context's positions ``(nq,)``; tell whether they are free."""
        return self.check_config_collision_free(self.update_context_positions(model_context, q).q)

    def check_context_edge_collision_free(
        self, model_context: CollisionCheckerContext, q1: ArrayLike, q2: ArrayLike
    ) -> bool:
        """Tell whether the edge from q1 to q2 ``(nq,)`` is free; the context then is at q2."""
        self.update_context_positions(model_context, q2)
        return self.check_edge_collision_free(q1, q2)

    def measure_context_edge(
        self, model_context: CollisionCheckerContext, q1: ArrayLike, q2: ArrayLike
    ) -> EdgeMeasure:
        """Measure the edge from q1 to q2 ``(nq,)``; the context then is at q2."""
        self.update_context_positions(model_context, q2)
        return self.measure_edge(q1, q2)

    def calc_context_robot_clearance(
        self, model_context: CollisionCheckerContext, q: ArrayLike, influence_distance: float
    ) -> RobotClearance:
        """Set a context's positions ``(nq,)``; return the clearance there up to a distance (m)."""
        context = self.update_context_positions(model_context, q)
        return self.calc_robot_clearance(context.q, influence_distance)

    def classify_context_body_collisions(
        self, model_context: CollisionCheckerContext, q: ArrayLike
    ) -> list[RobotCollisionType]:
        """Set a context's positions ``(nq,)``; return the type of each body's collisions."""
        return self.classify_body_collisions(self.update_context_positions(model_context, q).q)

    def max_context_num_distances(self, model_context: CollisionCheckerContext) -> int:
        """Return the largest number of rows of `calc_context_robot_clearance`."""
        self._contexts.own(model_context)
        return self.max_num_distances()


def one_configuration(name: str, q: ArrayLike) -> NDArray[np.float64]:
    """Return one configuration as a batch of one."""
    array = real_array(q, f"{name} must be numbers", CollisionCheckerError)
    if array.ndim != 1:
        raise CollisionCheckerError(f"{name} must have shape (nq,), not {array.shape}")
    return array[np.newaxis]


def one_edge(q1: ArrayLike, q2: ArrayLike) -> NDArray[np.float64]:
    """Return one edge as a batch of one; raises CollisionCheckerError for uneven ends."""
    first, second = one_configuration("q1", q1), one_configuration("q2", q2)
    if first.shape != second.shape:
        raise CollisionCheckerError(
            f"q1 and q2 must have the same shape, not {first[0].shape} and {second[0].shape}"
        )
    return np.stack([first[0], second[0]])[np.newaxis]
