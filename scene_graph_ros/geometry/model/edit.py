"""One edit of a model: its writes are decided first, and then done as a whole.

A function that edits reads the state and returns the writes; the state stays as it is
until all of that is known. One assignment of the owner's (`ModelOwner.change`) then makes the
edit happen: whoever looks at the state from there on does the writes first that are still to be
done. They may be done twice, so it does not matter where an interrupt, or a lack of memory, comes.
"""

from __future__ import annotations

from scene_graph_ros.geometry.model.derived import Part
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.state import GeometryState, new_version, ROLES
from scene_graph_ros.geometry.model.writes import Writes

__all__ = ["Edit"]

_OF_ROLE: dict[Part | Role, Role] = {Part.FILTERS: Role.PROXIMITY, **{r: r for r in ROLES}}
"""The parts that are of the geometry with a role."""


class Edit(Writes):
    """Writes to a state, in the order in which they are to be done."""

    __slots__ = ("_changes_model", "_parts", "state")

    def __init__(self, state: GeometryState) -> None:
        self._writes = []
        self.state = state
        """As it is before the edit."""
        self._parts: dict[Part | Role, None] = {}
        self._changes_model = False

    def changed(self, *parts: Part | Role) -> None:
        """Say that the model is another one, and which parts of it are."""
        self._changes_model = True
        for part in parts:
            self._parts[part] = None

    def complete(self) -> bool:
        """Add the versions of changed parts, and derived values that stay; False: none changed."""
        if not self._changes_model:
            return False
        state, parts, writes = self.state, self._parts, self._writes
        self.set(state, "version", new_version())
        versions = state.role_versions
        for part in parts:
            role = _OF_ROLE.get(part)
            if role is not None:
                writes.append((versions, role, new_version()))
        derived = state.derived.without(parts)
        if derived is not state.derived:
            self.set(state, "derived", derived)
        return True
