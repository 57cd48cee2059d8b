"""Regions that the node keeps, and which of them are free; imported when one is first kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import threading
from typing import Any, NamedTuple

import numpy as np

from msg_adapters.errors import TooLargeError
from msg_adapters.region_markers import region_form, RegionForm
from scene_graph_ros.geometry.errors import NameConflictError, SceneGraphError, UnknownIdError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.optimization import HPolyhedron, RegionCut, RegionTest, VPolytope
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["FollowedRegions", "KeptRegion", "KeptRegions", "Surroundings"]


@dataclass(frozen=True, eq=False)
class KeptRegion:
    """A bounded region of the world ``(3,)`` with a name, and geometries that it ignores."""

    name: str
    region: HPolyhedron
    ignored: frozenset[GeometryId]
    test: RegionTest

    @made_once
    def form(self) -> RegionForm | None:
        """Its hull, to be drawn; None where it is too thin for one in floats."""
        try:
            return region_form(VPolytope(self.region).vertices)
        except SceneGraphError:
            return None


class Surroundings:
    """The poses of all obstacles in a snapshot, to find the moved ones in a later one."""

    def __init__(self, query: QueryObject) -> None:
        snapshot, inspector = query.snapshot, query.inspector()
        self._version = snapshot.model_version
        self._ids = snapshot.proximity.geometry_ids
        # The snapshot's own array may be used for another one.
        self._X_WG = snapshot.X_WG.copy()
        self._shapes = tuple(map(inspector.get_shape, self._ids))
        self._kept: list[object] = []
        """Points of clouds, heights of fields: while they are kept, no others have their ids."""
        soft = {*inspector.get_all_deformable_geometry_ids()}
        if soft:
            soft &= {*inspector.get_all_geometry_ids(Role.PROXIMITY)}
        self._soft = {each: query.get_configurations_in_world(each) for each in soft}
        for each in snapshot.state.element_ids(Role.PROXIMITY):
            # Points that are set are another object; the pose tells whether these moved.
            placed = snapshot.element_set(each), snapshot.pose_in_world(each)
            self._soft[each] = np.append(placed[1].ravel(), id(placed[0]))
            self._kept.append(placed[0])

    def changed_since(self, before: Surroundings) -> tuple[set[GeometryId], set[GeometryId]]:
        """Return the new or moved obstacles, and those that are gone."""
        gone = {*before._ids, *before._soft} - {*self._ids, *self._soft}
        changed = {
            each
            for each, q in self._soft.items()
            if each not in before._soft or not np.array_equal(q, before._soft[each])
        }
        if self._version == before._version:
            moved = (self._X_WG != before._X_WG).any(axis=(1, 2))
            changed |= {self._ids[k] for k in np.flatnonzero(moved).tolist()}
            return changed, gone
        rows = {each: k for k, each in enumerate(before._ids)}
        for k, each in enumerate(self._ids):
            row = rows.get(each)
            if (
                row is None
                or self._shapes[k] is not before._shapes[row]
                or not np.array_equal(self._X_WG[k], before._X_WG[row])
            ):
                changed.add(each)
        return changed, gone


class FollowedRegions(NamedTuple):
    """All regions as they are in one snapshot, by name, each with the obstacles in it."""

    snapshot: WorldSnapshot
    regions: Mapping[str, tuple[KeptRegion, tuple[RegionCut, ...]]]
    revision: int
    """Another number where anything but the snapshot is other than before."""


class KeptRegions:
    """Regions by name. Any thread may ask."""

    def __init__(
        self, newest: Callable[[], WorldSnapshot], changed: Callable[[int], None]
    ) -> None:
        """``newest`` returns the world as it is; ``changed`` is told how many there are."""
        self._newest, self._changed = newest, changed
        self._lock = threading.RLock()
        self._regions: dict[str, KeptRegion] = {}
        self._cuts: dict[str, dict[GeometryId, RegionCut]] = {}
        self._surroundings: Surroundings | None = None
        self._revision = 0

    def keep(self, regions: Sequence[KeptRegion], *, replace: bool, most: int) -> None:
        """Keep all of these, or none.

        Raises NameConflictError for a name that is taken unless it may be replaced, TooLargeError
        where there would be more than ``most``.
        """
        with self._lock:
            taken = sorted(each.name for each in regions if each.name in self._regions)
            if taken and not replace:
                raise NameConflictError(
                    f"there is a region {quoted(taken[0])} already; it is replaced where replace"
                    " is true"
                )
            count = len({*self._regions, *(each.name for each in regions)})
            if count > most:
                raise TooLargeError(f"regions: {count} are more than max_regions, which is {most}")
            for each in regions:
                self._regions[each.name] = each
                self._cuts.pop(each.name, None)
            self._told()

    def remove(self, names: Sequence[str]) -> list[str]:
        """Forget some regions, all without names; return which. Raises UnknownIdError, or all."""
        with self._lock:
            gone = [each.name for each in self.named(names)]
            for name in gone:
                self._regions.pop(name, None)
                self._cuts.pop(name, None)
            if gone:
                self._told()
            return gone

    def _told(self) -> None:
        self._revision += 1
        self._changed(len(self._regions))

    def named(self, names: Sequence[str]) -> list[KeptRegion]:
        """Return regions by name, all in alphabetical order without. Raises UnknownIdError."""
        with self._lock:
            for name in names:
                if name not in self._regions:
                    raise UnknownIdError(
                        f"no region is called {quoted(name)}{suggestion(name, self._regions)}"
                    )
            return [self._regions[name] for name in names or sorted(self._regions)]

    def follow(self, snapshot: WorldSnapshot) -> FollowedRegions:
        """Look again at all changes, and return all regions."""
        with self._lock:
            around, before = Surroundings(snapshot.query), self._surroundings
            changed, gone = (set(), set()) if before is None else around.changed_since(before)
            for name, kept in self._regions.items():
                known = None if before is None else self._cuts.get(name)
                if known is None:
                    self._note(name, kept.test.cuts(snapshot.query, ignored=kept.ignored), {})
                elif changed or gone:
                    rest = {g: cut for g, cut in known.items() if g not in changed | gone}
                    cuts = (
                        kept.test.cuts(snapshot.query, ignored=kept.ignored, among=changed)
                        if changed
                        else []
                    )
                    self._note(name, cuts, rest)
            self._surroundings = around
            regions = {
                name: (kept, tuple(cut for _, cut in sorted(self._cuts[name].items())))
                for name, kept in self._regions.items()
            }
            return FollowedRegions(snapshot, regions, self._revision)

    def _note(
        self, name: str, cuts: Sequence[RegionCut], rest: dict[GeometryId, RegionCut]
    ) -> None:
        """Note the obstacles in a region; other ones are another revision."""
        now = {**rest, **{cut.geometry_id: cut for cut in cuts}}
        known = self._cuts.get(name)
        self._cuts[name] = now
        if known is None or _said(now) != _said(known):
            self._revision += 1

    def stale(self) -> str:
        """Name the regions that are not free, or say that nobody has looked since a change."""
        snapshot = self._newest()
        # Not to wait for what is being looked at.
        if not self._lock.acquire(blocking=False):
            return ""
        try:
            before, known = (
                self._surroundings,
                {name: self._cuts.get(name) for name in self._regions},
            )
        finally:
            self._lock.release()
        changed: set[Any] = set()
        if before is not None:
            changed = set.union(*Surroundings(snapshot.query).changed_since(before))
        unknown = [name for name, cuts in known.items() if cuts is None]
        if changed or unknown:
            what = f"{len(unknown)} regions" if unknown else "regions"
            return (
                f"{what} were not looked at since the scene changed: nobody listens to them, and"
                " check_regions was not asked"
            )
        cut = {name: cuts for name, cuts in known.items() if cuts}
        if not cut:
            return ""
        name, cuts = min(cut.items())
        who = snapshot.names.geometry_path(min(cuts))
        return f"{len(cut)} of {len(known)} regions are not free: {who} reaches into {name}"


def _said(cuts: Mapping[GeometryId, RegionCut]) -> Any:
    """Return the parts of cuts that make a difference to subscribers."""
    return {g: (cut.depth, cut.is_proven) for g, cut in cuts.items()}
