"""Deformable geometry of a source, as far as its configurations are concerned. No rclpy here."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scene_graph_ros.node.world.intake import UNSTAMPED

__all__ = ["SourceDeformables", "deformables_by_source"]


@dataclass
class SourceDeformables:
    """The deformable geometries of one source, with their newest configurations.

    ``ids`` has names that only one of them has, ``ambiguous`` the others; ``counts`` the vertices
    of each, ``positions`` ``(v, 3)`` where a configuration has come, ``stamps`` in nanoseconds;
    ``fresh`` are the geometries whose positions no snapshot has yet.
    ``foreign`` maps names of other sources' geometries to the source that owns them.
    """

    source: str
    ids: dict[str, Any]
    ambiguous: frozenset[str]
    counts: dict[Any, int]
    positions: dict[Any, np.ndarray] = field(default_factory=dict)
    stamps: dict[Any, int] = field(default_factory=dict)
    fresh: set[Any] = field(default_factory=set)
    foreign: Mapping[str, str] = field(default_factory=dict)

    def put(self, geometry_id: Any, positions: np.ndarray, stamp: int) -> None:
        """Take a new configuration."""
        self.positions[geometry_id], self.stamps[geometry_id] = positions, stamp
        self.fresh.add(geometry_id)

    def take_over(self, old: SourceDeformables) -> None:
        """Take the state of the same geometries in the scene before; all of it is fresh."""
        self.positions = {g: q for g, q in old.positions.items() if g in self.counts}
        self.stamps = {g: stamp for g, stamp in old.stamps.items() if g in self.counts}
        self.fresh = set(self.positions)

    def stamp(self) -> int:
        """Return the newest stamp of a configuration, nanoseconds."""
        return max(self.stamps.values(), default=UNSTAMPED)


def deformables_by_source(
    inspector: Any, sources: Mapping[str, Any]
) -> dict[str, SourceDeformables]:
    """Return those of all sources that have some, of which no configuration is known yet.

    ``sources`` maps names to ids.
    """
    by_owner = defaultdict(list)
    for geometry_id in inspector.get_all_deformable_geometry_ids():
        by_owner[inspector.get_owning_source_id(geometry_id)].append(geometry_id)
    result = {
        source: _of_source(source, by_owner[source_id], inspector)
        for source, source_id in sources.items()
        if source_id in by_owner
    }
    owners = {name: source for source, each in result.items() for name in each.ids}
    for deformables in result.values():
        deformables.foreign = owners
    return result


def _of_source(source: str, ids: Iterable[Any], inspector: Any) -> SourceDeformables:
    by_name = defaultdict(list)
    counts = {}
    for geometry_id in ids:
        by_name[inspector.get_name(geometry_id)].append(geometry_id)
        counts[geometry_id] = len(inspector.get_reference_mesh(geometry_id).vertices)
    return SourceDeformables(
        source,
        {name: found[0] for name, found in by_name.items() if len(found) == 1},
        frozenset(name for name, found in by_name.items() if len(found) > 1),
        counts,
    )
