"""Height fields of a source, as far as its messages of heights are concerned. No rclpy here."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TYPE_CHECKING

from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.ids import GeometryId, SourceId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.intake import UNSTAMPED

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.height_set import HeightSet

__all__ = ["NoFieldError", "SourceFields", "fields_by_source"]


class NoFieldError(UnknownIdError):
    """Heights of a source of which nobody knows whose they are."""


@dataclass
class SourceFields:
    """The height fields of one source; a context has their heights.

    ``ids`` are the geometries, ``heard`` those whose heights a message brought, ``fresh`` has
    heights that no context has yet, ``stamp`` is the newest, ns.
    """

    source: SourceId
    ids: list[GeometryId]
    inspector: Any
    stamp: int = UNSTAMPED
    heard: set[GeometryId] = field(default_factory=set)
    fresh: dict[GeometryId, HeightSet] = field(default_factory=dict)

    def field(self) -> GeometryId:
        """Return the geometry that messages are about. Raises NoFieldError."""
        if len(self.ids) != 1:
            names = sorted(self.inspector.get_name(geometry) for geometry in self.ids)
            raise NoFieldError(
                f"the source has {len(names)} height fields, {quoted(names)}, so nobody knows"
                " whose heights a message has: have a source for each"
            )
        return self.ids[0]

    def put(self, geometry_id: GeometryId, heights: HeightSet, stamp: int) -> None:
        """Take heights, of a time, ns."""
        self.fresh[geometry_id] = heights
        self.stamp = stamp

    def bring(self, context: Context) -> None:
        """Give a context the fresh heights."""
        context.set_heights(self.source, self.fresh)
        self.heard.update(self.fresh)
        self.fresh.clear()

    def take_over(self, old: SourceFields, before: Context, context: Context) -> None:
        """Take the state of the same fields in the scene before, and give a context heights."""
        self.heard = old.heard & set(self.ids)
        self.stamp = old.stamp
        heights = {g: before.snapshot.height_set(g) for g in self.heard}
        context.set_heights(self.source, heights)

    def forget(self, after: int) -> None:
        """Forget a stamp later than that; the heights hold."""
        self.stamp = UNSTAMPED if self.stamp > after else self.stamp


def fields_by_source(inspector: Any, sources: Mapping[str, SourceId]) -> dict[str, SourceFields]:
    """Return those of all sources that have some; ``sources`` maps names to ids."""
    by_owner: dict[SourceId, list[GeometryId]] = defaultdict(list)
    for geometry_id in inspector.get_all_height_field_ids():
        by_owner[inspector.get_owning_source_id(geometry_id)].append(geometry_id)
    return {
        name: SourceFields(source, by_owner[source], inspector)
        for name, source in sources.items()
        if source in by_owner
    }
