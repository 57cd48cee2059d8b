"""Who holds a model: sharing without copies, changing without others noticing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import threading

from scene_graph_ros.geometry.model.collision_filter import CollisionFilterScope
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.no_copies import NotCopied
from scene_graph_ros.geometry.model.pair_filter import PairFilter
from scene_graph_ros.geometry.model.state import GeometryState

__all__ = ["ModelOwner"]


class ModelOwner(NotCopied):
    """Holds a state that it may share; before the first change of a shared one it copies it."""

    _instead = "clone() makes an independent one; save scenes as files, and poses as arrays"

    def __init__(self, state: GeometryState) -> None:
        self._state = state
        self._lock = threading.RLock()

    @property
    def state(self) -> GeometryState:
        """The current model, to look at now: it may be changed in place later."""
        return self._state

    def share(self) -> GeometryState:
        """Return the current model as one that nobody changes any more."""
        with self._lock:
            self._state.shared = True
            return self._state

    @contextlib.contextmanager
    def changing(self) -> Iterator[GeometryState]:
        """Give a state that may be changed. Whoever changes it checks everything first."""
        with self._lock:
            if self._state.shared:
                self._state = self._state.copy()
            yield self._state

    def filters(self) -> PairFilter:
        """Return the collision filters, to look at."""
        return self._state.filters

    def resolve_set(
        self, geometry_set: GeometrySet, scope: CollisionFilterScope
    ) -> frozenset[GeometryId]:
        """Return the geometries a filter declaration is about."""
        return self._state.proximity_ids(geometry_set, scope)

    def change_filters(self, change: Callable[[PairFilter], object]) -> object:
        """Apply a change to the collision filters and return what it returns."""
        with self.changing() as state:
            result = change(state.filters)
            state.filters_changed()
            return result
