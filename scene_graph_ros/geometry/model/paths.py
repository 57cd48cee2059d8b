"""The full names of geometries, as in scene files and messages."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.one_line import cut
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["GeometryPair", "path_of"]

_LONGEST_NAME = 70


def path_of(state: GeometryState, any_id: FrameId | GeometryId) -> str:
    """Return ``source/frame`` or ``source/frame/geometry``. Raises UnknownIdError."""
    if isinstance(any_id, GeometryId):
        record = state.geometry(any_id)
        frame = state.frame(record.frame_id)
        return f"{state.source_names[record.source_id]}/{frame.name}/{record.name}"
    frame = state.frame(any_id)
    return f"{state.source_names[frame.source_id]}/{frame.name}"


class GeometryPair(tuple[GeometryId, GeometryId]):
    """Two geometries: the tuple of their ids, the first in the scene's order, with their names.

    ``name_A`` and ``name_B`` are paths, ``source/frame/geometry``.
    """

    name_A: str
    name_B: str

    def __new__(
        cls, id_A: GeometryId, id_B: GeometryId, name_A: str = "", name_B: str = ""
    ) -> GeometryPair:
        """Make a pair; where a name is not given it is the id.

        Raises TypeError unless they are an id and a text.
        """
        given: Any
        for label, given in (("id_A", id_A), ("id_B", id_B)):
            if not isinstance(given, GeometryId):
                raise TypeError(f"{label} must be a GeometryId, not {quoted(given)}")
        for label, given in (("name_A", name_A), ("name_B", name_B)):
            if not isinstance(given, str):
                raise TypeError(f"{label} must be text, not {quoted(given)}")
        pair = super().__new__(cls, (id_A, id_B))
        pair.name_A = name_A or repr(id_A)
        pair.name_B = name_B or repr(id_B)
        return pair

    @property
    def id_A(self) -> GeometryId:
        """The first geometry."""
        return self[0]

    @property
    def id_B(self) -> GeometryId:
        """The second geometry."""
        return self[1]

    def __getnewargs__(self) -> tuple[Any, ...]:
        return self[0], self[1], self.name_A, self.name_B

    def __str__(self) -> str:
        return f"{self.name_A} and {self.name_B}"

    def __repr__(self) -> str:
        names = (cut(name, _LONGEST_NAME) for name in (self.name_A, self.name_B))
        return f"GeometryPair({', '.join(names)})"
