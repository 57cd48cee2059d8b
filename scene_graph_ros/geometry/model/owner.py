"""The owner of a model: sharing without copies, changing without others noticing."""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Concatenate, ParamSpec, TypeVar

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.model.collision_filter import CollisionFilterScope
from scene_graph_ros.geometry.model.derived import Part
from scene_graph_ros.geometry.model.edit import Edit
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.no_copies import NotCopied
from scene_graph_ros.geometry.model.pair_filter import PairFilter
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.model.writes import Writes
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["ModelOwner"]

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class ModelOwner(NotCopied):
    """Holds a state that it may share; before the first change of a shared one it copies it."""

    _instead = "clone() makes an independent one; save scenes as files, and poses as arrays"

    def __init__(self, state: GeometryState) -> None:
        self._state = state
        self._edit: Edit | None = None
        """An edit that has happened, and of which some writes may not be done yet."""
        self._lock = threading.RLock()

    @property
    def state(self) -> GeometryState:
        """The current model, to look at now: it may be changed in place later."""
        if self._edit is not None:
            self._finish()
        return self._state

    def share(self) -> GeometryState:
        """Return the current model as one that nobody changes any more."""
        with self._lock:
            state = self.state
            state.shared = True
            return state

    def change(
        self,
        edit: Callable[Concatenate[Edit, Arguments], Result],
        *arguments: Arguments.args,
        **named: Arguments.kwargs,
    ) -> Result:
        """Change the model as ``edit`` says, as a whole, and return its answer.

        Where it raises, or where it is interrupted, nothing is changed.
        """
        with self._lock:
            state = self.state
            made = Edit(state.copy() if state.shared else state)
            result = edit(made, *arguments, **named)
            if made.complete():
                self._edit = made  # it has happened
                self._do(made)
            return result

    def all_or_nothing(self, changes: Callable[[], Result]) -> Result:
        """Make several changes; where that raises, or is interrupted, none of them is made.

        Raises QueryArgumentError for an object that can't be called.
        """
        if not callable(changes):
            raise QueryArgumentError(f"changes must be a function, not {quoted(changes)}")
        with self._lock:
            before = self.share()  # so that they are made to a copy
            try:
                return changes()
            except BaseException:
                self._edit = None
                self._state = before
                raise

    def _finish(self) -> None:
        """Do the writes of the last edit; may be interrupted, and is then done again."""
        with self._lock:
            edit = self._edit
            if edit is not None:  # else another thread has done it meanwhile
                self._do(edit)

    def _do(self, edit: Edit) -> None:
        edit.write()
        self._state = edit.state
        self._edit = None

    def filters(self) -> PairFilter:
        """Return the collision filters, to look at."""
        return self.state.filters

    def resolve_set(
        self, geometry_set: GeometrySet, scope: CollisionFilterScope
    ) -> frozenset[GeometryId]:
        """Return the geometries a filter declaration is about."""
        return self.state.proximity_ids(geometry_set, scope)

    def change_filters(
        self,
        change: Callable[Concatenate[PairFilter, Writes, Arguments], Result],
        *arguments: Arguments.args,
        **named: Arguments.kwargs,
    ) -> Result:
        """Apply a change to the collision filters and return its answer."""
        return self.change(_of_filters, change, *arguments, **named)


def _of_filters(
    edit: Edit,
    change: Callable[Concatenate[PairFilter, Writes, Arguments], Result],
    *arguments: Arguments.args,
    **named: Arguments.kwargs,
) -> Result:
    result = change(edit.state.filters, edit, *arguments, **named)
    edit.changed(Part.FILTERS)
    return result
