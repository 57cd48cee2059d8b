"""The state of a collision checker, and its changes: shapes, paddings, filters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
import threading
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.spatial.poses import as_pose
from scene_graph_ros.planning.checker.added_shapes import AddedShape, BodyShapeDescription
from scene_graph_ros.planning.checker.body_matrices import BodyMatrices
from scene_graph_ros.planning.checker.checker_bodies import AnyBody, CheckerBody
from scene_graph_ros.planning.checker.checker_state import CheckerState, GeometryPadding
from scene_graph_ros.planning.errors import CollisionCheckerError

__all__ = ["ChangingState"]


class ChangingState:
    """Bodies of a checker, with shapes, paddings and filters that may be changed.

    Each change makes another state and puts it in place at once: a question that is being answered
    keeps its own, in any thread. A body is a frame of the scene with all geometries on it; it is
    named by its index, its `CheckerBody`, its frame's id, or its name. Methods raise
    CollisionCheckerError naming the argument and its value, and then have changed nothing.
    """

    def __init__(self, state: CheckerState) -> None:
        self.now = state
        self._lock = threading.RLock()

    def _set_matrices(self, change: Callable[[BodyMatrices], BodyMatrices]) -> None:
        with self._lock:
            state = self.now
            self.now = state.with_matrices(change(state.matrices))

    # Bodies.

    @property
    def bodies(self) -> tuple[CheckerBody, ...]:
        """All bodies by index: robots' first; rows and columns of the matrices."""
        return self.now.bodies.all

    def get_body(self, body: AnyBody) -> CheckerBody:
        """Return a body."""
        return self.now.bodies.find(body)

    def is_part_of_robot(self, body: AnyBody) -> bool:
        """Tell whether a body is a link of the checker's robots, or carried by one."""
        return self.now.bodies.is_part_of_robot(self.get_body(body).index)

    def _pair(self, bodyA: AnyBody, bodyB: AnyBody) -> tuple[int, int]:
        find = self.now.bodies.find
        return find(bodyA, "bodyA").index, find(bodyB, "bodyB").index

    # Shapes.

    def add_collision_shape(self, group_name: str, description: BodyShapeDescription) -> bool:
        """Add a shape to a body, under the name of a group; tell whether it was added.

        The body's padding and filters hold for it. A half space on a moving body is not
        added. Raises MeshError for a mesh that cannot be used.
        """
        return self.add_groups({group_name: [description]})[group_name] == 1

    def add_groups(self, groups: Mapping[str, Sequence[BodyShapeDescription]]) -> dict[str, int]:
        """Add the shapes of groups, all at once; return how many of each were added."""
        added = {name: self._shapes(name, each) for name, each in groups.items()}
        self._add([shape for shapes in added.values() for shape in shapes])
        return {name: len(shapes) for name, shapes in added.items()}

    def add_collision_shape_to_body(
        self, group_name: str, bodyA: AnyBody, shape: Shape, X_AG: ArrayLike
    ) -> bool:
        """Add a shape to body A, at ``X_AG`` ``(4, 4)``; see `add_collision_shape`."""
        body = self.now.bodies.find(bodyA, "bodyA")
        pose = as_pose(X_AG, f"X_AG in {body.body_name!r}")
        names = body.model_instance_name, body.body_name
        return self.add_collision_shape(group_name, BodyShapeDescription(shape, pose, *names))

    def add_collision_shape_to_frame(
        self, group_name: str, frameA: AnyBody, shape: Shape, X_AG: ArrayLike
    ) -> bool:
        """Add a shape to frame A, a body, at ``X_AG`` ``(4, 4)``; see `add_collision_shape`."""
        frame = self.now.bodies.find(frameA, "frameA")
        return self.add_collision_shape_to_body(group_name, frame, shape, X_AG)

    def get_all_added_collision_shapes(self) -> dict[str, list[BodyShapeDescription]]:
        """Return the added shapes, by group."""
        result: dict[str, list[BodyShapeDescription]] = {}
        for each in self.now.added:
            result.setdefault(each.group, []).append(each.description)
        return result

    def remove_all_added_collision_shapes(self, group_name: str | None = None) -> None:
        """Remove the shapes of a group, or of all; a group that is not there has none."""
        with self._lock:
            state = self.now
            kept = [] if group_name is None else [a for a in state.added if a.group != group_name]
            if len(kept) != len(state.added):
                self.now = state.with_added(kept)

    def _shapes(self, group: str, descriptions: Sequence[BodyShapeDescription]) -> list[Any]:
        bodies, result = self.now.bodies, []
        for each in descriptions:
            if not isinstance(each, BodyShapeDescription):
                raise CollisionCheckerError(
                    f"descriptions of group {quoted(group)} must be BodyShapeDescriptions, not"
                    f" {quoted(each)}"
                )
            body = bodies.find(f"{each.model_instance_name}/{each.body_name}", "body_name")
            shape = AddedShape.of(group, each, body.frame_id)
            if not (body.link >= 0 and isinstance(each.shape, HalfSpace)):
                result.append(shape)
        return result

    def _add(self, shapes: Sequence[AddedShape]) -> None:
        if shapes:
            with self._lock:
                self.now = self.now.with_added((*self.now.added, *shapes))

    # Paddings.

    def get_padding_between(self, bodyA: AnyBody, bodyB: AnyBody) -> float:
        """Return the padding between two bodies, in m; 0 of a body to itself."""
        a, b = sorted(self._pair(bodyA, bodyB))
        padding = self.now.matrices.padding
        return float(padding[a, b]) if a < len(padding) else 0.0

    def set_padding_between(self, bodyA: AnyBody, bodyB: AnyBody, padding: float) -> None:
        """Set the padding between two bodies, in m; a negative one allows that they overlap.

        One of them must be a robot's.
        """
        pair = self._pair(bodyA, bodyB)
        self._set_matrices(lambda m: m.with_padding_between(*pair, padding))

    def set_paddings_between(self, paddings: Mapping[tuple[AnyBody, AnyBody], float]) -> None:
        """Set the paddings of several pairs of bodies, in m, all at once."""
        pairs = [(*self._pair(*bodies), padding) for bodies, padding in paddings.items()]

        def change(matrices: BodyMatrices) -> BodyMatrices:
            for a, b, padding in pairs:
                matrices = matrices.with_padding_between(a, b, padding)
            return matrices

        self._set_matrices(change)

    def set_paddings_between_geometries(
        self,
        paddings: Iterable[tuple[Iterable[GeometryId] | None, Iterable[GeometryId] | None, float]],
    ) -> None:
        """Set geometries' paddings from others, in m, in place of their bodies' paddings.

        Each entry has two sets of ids, None for all, and the padding; later entries overrule
        earlier ones, and those of earlier calls are forgotten. Paddings of bodies that are set
        afterwards leave them.
        """
        own = [GeometryPadding.of_ids(*entry) for entry in paddings]
        with self._lock:
            self.now = self.now.with_geometry_paddings(own)

    def get_padding_matrix(self) -> NDArray[np.float64]:
        """Return all paddings ``(n, n)`` of n bodies, in m."""
        return self.now.matrices.padding_matrix()

    def set_padding_matrix(self, collision_padding: ArrayLike) -> None:
        """Set all paddings ``(n, n)``, in m.

        They must be finite and symmetric, and zero on the diagonal and between bodies around the
        robots.
        """
        self._set_matrices(lambda m: m.with_padding_matrix(collision_padding))

    def set_padding_all_robot_environment_pairs(self, padding: float) -> None:
        """Set the padding of robots from all around them, in m."""
        self._set_matrices(lambda m: m.with_environment_padding(padding))

    def set_padding_all_robot_robot_pairs(self, padding: float) -> None:
        """Set the padding of robots' bodies from each other, in m."""
        self._set_matrices(lambda m: m.with_robot_padding(padding))

    def set_padding_one_robot_body_all_environment_pairs(
        self, body: AnyBody, padding: float
    ) -> None:
        """Set the padding of one body of a robot from all around, in m."""
        index = self.get_body(body).index
        self._set_matrices(lambda m: m.with_environment_padding(padding, index))

    def get_largest_padding(self) -> float:
        """Return the largest padding (m) of a robot's body and any other; may be negative."""
        return self.now.matrices.largest_padding()

    def maybe_get_uniform_robot_environment_padding(self) -> float | None:
        """Return the padding (m) of robots to all around, None where it is not one."""
        return self.now.matrices.uniform_environment_padding()

    def maybe_get_uniform_robot_robot_padding(self) -> float | None:
        """Return the padding (m) between robots' bodies, None where it is not one."""
        return self.now.matrices.uniform_robot_padding()

    # Filters.

    def get_nominal_filtered_collision_matrix(self) -> NDArray[np.int8]:
        """Return the filters ``(n, n)`` that the scene had when the checker was made.

        1 where no joint moves two bodies against each other, and where the scene filters all pairs
        of their geometries; -1 on the diagonal and between two bodies around robots; else 0.
        Where the scene filters only some pairs of two bodies' geometries, these are never checked.
        """
        return self.now.nominal.filter_matrix()

    def get_filtered_collision_matrix(self) -> NDArray[np.int8]:
        """Return the present filters ``(n, n)``, as `get_nominal_filtered_collision_matrix`."""
        return self.now.matrices.filter_matrix()

    def set_collision_filter_matrix(self, filter_matrix: ArrayLike) -> None:
        """Set all filters ``(n, n)``: 0 or 1, symmetric, with -1 where it always is."""
        self._set_matrices(lambda m: m.with_filter_matrix(filter_matrix))

    def is_collision_filtered_between(self, bodyA: AnyBody, bodyB: AnyBody) -> bool:
        """Tell whether two bodies are not checked; so it is for two bodies around robots."""
        return self.now.matrices.is_filtered(*self._pair(bodyA, bodyB))

    def set_collision_filtered_between(
        self, bodyA: AnyBody, bodyB: AnyBody, filter_collision: bool
    ) -> None:
        """Have two bodies checked, or not. They must differ, and one must be a robot's."""
        pair = self._pair(bodyA, bodyB)
        self._set_matrices(lambda m: m.with_filter_between(*pair, filter_collision))

    def set_collision_filtered_with_all_bodies(self, body: AnyBody) -> None:
        """Have a robot's body not checked at all."""
        index = self.get_body(body).index
        self._set_matrices(lambda m: m.with_all_filtered(index))
