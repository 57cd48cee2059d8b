"""The interface of all collision checkers, also with another notion of collision."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
import copy
from typing import Any, overload, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.checker.added_shapes import BodyShapeDescription
from scene_graph_ros.planning.checker.batches_of_one import one_configuration, one_edge
from scene_graph_ros.planning.checker.changing_state import ChangingState
from scene_graph_ros.planning.checker.checker_bodies import CheckerBody
from scene_graph_ros.planning.checker.checker_contexts import (
    checked_parallelism,
    CheckerContexts,
    CollisionCheckerContext,
)
from scene_graph_ros.planning.checker.checker_state import CheckerState
from scene_graph_ros.planning.checker.collision_checker_params import CollisionCheckerParams
from scene_graph_ros.planning.checker.configuration_ways import ConfigurationWays
from scene_graph_ros.planning.checker.delegation import Delegation, synonym
from scene_graph_ros.planning.checker.distance_and_interpolation import (
    ConfigurationDistanceFunction,
    ConfigurationInterpolationFunction,
    DistanceAndInterpolationProvider,
)
from scene_graph_ros.planning.checker.homogeneous_filters import (
    as_switch,
    demand_homogeneous_filters,
)
from scene_graph_ros.planning.checker.robot_clearance import RobotClearance, RobotCollisionType
from scene_graph_ros.planning.diagrams.robot_diagram import RobotDiagram
from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure

__all__ = ["CollisionChecker"]

of_state = Delegation("_changing")
of_ways = Delegation("_interpolation")

Self = TypeVar("Self", bound="CollisionChecker")


@one_line("robot_model_instances")
class CollisionChecker(ABC):
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
        self._changing = ChangingState(state)
        self._interpolation = ConfigurationWays(
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
        """Return a checker of its own: no later change of one is seen by the other."""
        return self._with_state(self._state)

    def _with_state(self: Self, state: CheckerState) -> Self:
        """Return a checker with a state, ways and contexts of its own."""
        result = copy.copy(self)
        result._changing, result._interpolation = (
            ChangingState(state),
            copy.copy(self._interpolation),
        )
        result._contexts = CheckerContexts(self._contexts.count, lambda: result._state)
        return result

    @property
    def _state(self) -> CheckerState:
        return self._changing.now

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

    # Bodies, and shapes, paddings and filters that may be changed (see `ChangingState`).

    @property
    def bodies(self) -> tuple[CheckerBody, ...]:
        """All bodies by index: robots' first; rows and columns of the matrices."""
        return self._changing.bodies

    @overload
    def add_collision_shapes(
        self, group_name: str, descriptions: Sequence[BodyShapeDescription]
    ) -> int: ...

    @overload
    def add_collision_shapes(
        self, group_name: Mapping[str, Sequence[BodyShapeDescription]]
    ) -> dict[str, int]: ...

    def add_collision_shapes(
        self,
        group_name: str | Mapping[str, Sequence[BodyShapeDescription]],
        descriptions: Sequence[BodyShapeDescription] = (),
    ) -> int | dict[str, int]:
        """Add shapes to bodies, all at once; return how many were added.

        Of a group, or of several: then by their names. See `add_collision_shape`.
        """
        if isinstance(group_name, Mapping):
            return self._changing.add_groups(group_name)
        return self._changing.add_groups({group_name: descriptions})[group_name]

    get_body = of_state(ChangingState.get_body)
    is_part_of_robot = of_state(ChangingState.is_part_of_robot)
    add_collision_shape = of_state(ChangingState.add_collision_shape)
    add_collision_shape_to_body = of_state(ChangingState.add_collision_shape_to_body)
    add_collision_shape_to_frame = of_state(ChangingState.add_collision_shape_to_frame)
    get_all_added_collision_shapes = of_state(ChangingState.get_all_added_collision_shapes)
    remove_all_added_collision_shapes = of_state(ChangingState.remove_all_added_collision_shapes)
    get_padding_between = of_state(ChangingState.get_padding_between)
    set_padding_between = of_state(ChangingState.set_padding_between)
    set_paddings_between = of_state(ChangingState.set_paddings_between)
    set_paddings_between_geometries = of_state(ChangingState.set_paddings_between_geometries)
    get_padding_matrix = of_state(ChangingState.get_padding_matrix)
    set_padding_matrix = of_state(ChangingState.set_padding_matrix)
    set_padding_all_robot_environment_pairs = of_state(
        ChangingState.set_padding_all_robot_environment_pairs
    )
    set_padding_all_robot_robot_pairs = of_state(ChangingState.set_padding_all_robot_robot_pairs)
    set_padding_one_robot_body_all_environment_pairs = of_state(
        ChangingState.set_padding_one_robot_body_all_environment_pairs
    )
    get_largest_padding = of_state(ChangingState.get_largest_padding)
    maybe_get_uniform_robot_environment_padding = of_state(
        ChangingState.maybe_get_uniform_robot_environment_padding
    )
    maybe_get_uniform_robot_robot_padding = of_state(
        ChangingState.maybe_get_uniform_robot_robot_padding
    )
    get_nominal_filtered_collision_matrix = of_state(
        ChangingState.get_nominal_filtered_collision_matrix
    )
    get_filtered_collision_matrix = of_state(ChangingState.get_filtered_collision_matrix)
    set_collision_filter_matrix = of_state(ChangingState.set_collision_filter_matrix)
    is_collision_filtered_between = of_state(ChangingState.is_collision_filtered_between)
    set_collision_filtered_between = of_state(ChangingState.set_collision_filtered_between)
    set_collision_filtered_with_all_bodies = of_state(
        ChangingState.set_collision_filtered_with_all_bodies
    )

    # The provider, and ways between configurations.

    @property
    def edge_step_size(self) -> float:
        """The largest length of a piece of a way that is not straight, in the distance's unit."""
        return self._interpolation.edge_step_size

    @edge_step_size.setter
    def edge_step_size(self, value: float) -> None:
        self._interpolation.set_edge_step_size(value)

    @property
    def distance_and_interpolation_provider(self) -> DistanceAndInterpolationProvider:
        """The one in use."""
        return self._interpolation.provider

    @property
    def is_straight(self) -> bool:
        """Whether ways are straight edges."""
        return self._interpolation.is_straight

    set_edge_step_size = of_ways(ConfigurationWays.set_edge_step_size)
    set_distance_and_interpolation_provider = of_ways(
        ConfigurationWays.set_distance_and_interpolation_provider
    )
    compute_configuration_distance = of_ways(ConfigurationWays.compute_configuration_distance)
    interpolate_between_configurations = of_ways(
        ConfigurationWays.interpolate_between_configurations
    )
    way = of_ways(ConfigurationWays.way)
    samples = of_ways(ConfigurationWays.samples)

    set_configuration_distance_function = of_ways(
        ConfigurationWays.set_configuration_distance_function
    )
    set_configuration_interpolation_function = of_ways(
        ConfigurationWays.set_configuration_interpolation_function
    )

    def make_standalone_configuration_distance_function(self) -> ConfigurationDistanceFunction:
        """Return a function that answers as this checker does, also after a change of it."""
        return self.compute_configuration_distance

    def make_standalone_configuration_interpolation_function(
        self,
    ) -> ConfigurationInterpolationFunction:
        """Return a function that answers as this checker does, also after a change of it."""
        return self.interpolate_between_configurations

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
        free = [
            self.check_configs_collision_free(samples, threads=threads).all()
            for samples in self._interpolation.samples_of(edges)
        ]
        return np.array(free, dtype=np.bool_)

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

    measure_edge_collision_free = synonym(measure_edge)

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

    measure_context_edge_collision_free = synonym(measure_context_edge)

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
