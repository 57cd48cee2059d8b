"""Some of a robot's degrees of freedom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.located import suggestion
from scene_graph_ros.planning.errors import CollisionCheckerError
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_joint import PARTS

__all__ = ["DofMask"]


@one_line()
@dataclass(frozen=True, eq=False)
class DofMask:
    """Which of n positions, or velocities, are meant: ``selected`` ``(n,)``, of True and False.

    Sets of them are combined by methods; arrays of all are cut to those that are selected, and put
    back. Raises CollisionCheckerError for what is no list of truth values.
    """

    selected: NDArray[np.bool_]

    def __post_init__(self) -> None:
        """Check and freeze the array."""
        given: NDArray[Any]
        try:
            given = np.asarray(self.selected)
        except ValueError:
            given = np.zeros(1)
        if given.shape == (0,):
            given = np.zeros(0, dtype=np.bool_)
        if given.dtype != np.bool_ or given.ndim != 1:
            raise CollisionCheckerError(
                f"DofMask: selected must be True or False (n,), not {quoted(self.selected)}"
            )
        own = given.copy()
        own.setflags(write=False)
        object.__setattr__(self, "selected", own)

    @classmethod
    def make_from_model(cls, tree: KinematicTree, of: str | Sequence[str]) -> DofMask:
        """Return the positions of a group of the robot's SRDF, or of joints by their names.

        Joints that follow others have none. Raises KinematicTreeError for an unknown group,
        CollisionCheckerError for other joints.
        """
        given: tuple[Any, Any] = (tree, of)
        if not isinstance(given[0], KinematicTree):
            raise CollisionCheckerError(
                f"DofMask: tree must be a KinematicTree, not {quoted(tree)}"
            )
        if not isinstance(given[1], str | Sequence):
            raise CollisionCheckerError(
                f"DofMask: of must be a group or names of joints, not {quoted(of)}"
            )
        selected = np.zeros(tree.num_positions, dtype=np.bool_)
        if isinstance(of, str):
            selected[tree.group_positions(of)] = True
            return cls(selected)
        places: dict[str, slice] = {}
        first = 0
        for joint in tree.joints:
            count = 0 if joint.mimics else len(PARTS[joint.kind][0]) or 1
            places[joint.name] = slice(first, first + count)
            first += count
        for name in given[1]:
            if not isinstance(name, str) or name not in places:
                near = suggestion(str(name), list(places))
                raise CollisionCheckerError(f"DofMask: there is no joint {quoted(name)}{near}")
            selected[places[name]] = True
        return cls(selected)

    @property
    def size(self) -> int:
        """The number n of all."""
        return len(self.selected)

    @property
    def count(self) -> int:
        """How many are selected."""
        return int(np.count_nonzero(self.selected))

    def complement(self) -> DofMask:
        """Return those that are not selected."""
        return DofMask(~self.selected)

    def union(self, other: DofMask) -> DofMask:
        """Return those that are in one or both. Raises CollisionCheckerError for other sizes."""
        return DofMask(self.selected | self._same(other, "union").selected)

    def intersect(self, other: DofMask) -> DofMask:
        """Return those that are in both. Raises CollisionCheckerError for other sizes."""
        return DofMask(self.selected & self._same(other, "intersect").selected)

    def subtract(self, other: DofMask) -> DofMask:
        """Return those that aren't in another. Raises as `union`."""
        return DofMask(self.selected & ~self._same(other, "subtract").selected)

    def get_from_array(self, full_array: ArrayLike) -> NDArray[np.float64]:
        """Return the selected entries ``(..., count)`` of arrays ``(..., n)``."""
        return _numbers(full_array, self.size, "get_from_array: full_array")[..., self.selected]

    def set_in_array(
        self, selected_values: ArrayLike, full_array: ArrayLike
    ) -> NDArray[np.float64]:
        """Return arrays ``(..., n)`` with other selected entries ``(..., count)``."""
        result = _numbers(full_array, self.size, "set_in_array: full_array").copy()
        given = _numbers(selected_values, self.count, "set_in_array: selected_values")
        if given.shape[:-1] not in ((), result.shape[:-1]):
            raise CollisionCheckerError(
                f"DofMask.set_in_array: selected_values {given.shape} don't go into {result.shape}"
            )
        result[..., self.selected] = given
        return result

    def get_selected_to_full_index(self) -> NDArray[np.intp]:
        """Return the indices of the selected ones among all, ``(count,)``."""
        return np.flatnonzero(self.selected)

    def get_full_to_selected_index(self) -> list[int | None]:
        """Return for each of all where it is among the selected ones; None where it is not."""
        places = np.cumsum(self.selected) - 1
        return [int(k) if s else None for k, s in zip(places, self.selected, strict=True)]

    def _same(self, other: Any, question: str) -> DofMask:
        if not isinstance(other, DofMask) or other.size != self.size:
            raise CollisionCheckerError(
                f"DofMask.{question}: other must be a DofMask of {self.size}, not {quoted(other)}"
            )
        return other

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, DofMask):
            return NotImplemented
        return bool(np.array_equal(self.selected, other.selected))

    def __hash__(self) -> int:
        return hash(self.selected.tobytes())


def _numbers(values: ArrayLike, count: int, name: str) -> NDArray[np.float64]:
    rule = f"DofMask.{name} must be numbers (..., {count})"
    found = real_array(values, rule, CollisionCheckerError)
    if not found.ndim or found.shape[-1] != count:
        raise CollisionCheckerError(f"{rule}, not {quoted(values)}")
    return found
