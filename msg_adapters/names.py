"""Names in messages: ids and paths to the core's ids, and back.

A geometry's path is ``<source>/<frame>/<name>``, a frame's ``<source>/<frame>``. A bare name does
where only one thing in the scene is called so. A leading slash is passed over, as no name begins
with one. Names of frames and geometries may contain slashes
themselves: paths are compared as a whole, never taken apart.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from msg_adapters.arrays import int64s_to_msg
from msg_adapters.poses import meant_name
from scene_graph_msgs.msg import GeometryName, GeometryNames, GeometryReference
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.steps import between_steps

__all__ = ["SceneNames", "legend"]

T = TypeVar("T", SourceId, FrameId, GeometryId)

_LISTED = 5
"""How many candidates an error about an ambiguous name lists."""


class SceneNames:
    """All names of one version of a scene; make another when the scene changes.

    Tables are made when they are first needed. Safe to read from several threads.
    """

    def __init__(self, inspector: Any, before: SceneNames | None = None) -> None:
        """Take the names that ``inspector``, which must not change any more, knows.

        Of things that are as in the scene ``before``, the messages that name them are the same
        objects: by that one can tell whether something kept with a name still holds.
        """
        self._inspector = inspector
        self._names: dict[int, GeometryName] = {}
        if before is not None:
            known = before._names
            unchanged = inspector.get_unchanged_geometry_ids(before._inspector)
            self._names = {int(i): known[int(i)] for i in unchanged if int(i) in known}

    def known_name(self, value: int) -> GeometryName | None:
        """Return the message that names a geometry if it was asked for before, else None."""
        return self._names.get(value)

    def source_id(self, name: str) -> SourceId:
        """Return the source called ``name``; raises UnknownIdError."""
        source = self._sources.get(meant_name(name))
        if source is None:
            raise UnknownIdError(f"there is no source {quoted(name)}")
        return source

    def source_name(self, item: FrameId | GeometryId) -> str:
        """Return the name of the source that registered a frame or geometry."""
        return self._inspector.get_owning_source_name(item)

    def frame_id(self, name: str, source: str | None = None) -> FrameId:
        """Return the frame with this path, or with this bare name, of ``source`` if given.

        Raises UnknownIdError for a name that is not there, NameConflictError for a bare name
        that several frames have.
        """
        if source is None:
            return _find(name, self._frame_paths, self._frame_bare_names, "frame", self.frame_path)
        self.source_id(source)
        found = self._frame_paths.get(f"{meant_name(source)}/{meant_name(name)}", [])
        if not found:
            raise UnknownIdError(f"source {quoted(source)} has no frame {quoted(name)}")
        return found[0]

    def frame_path(self, frame_id: FrameId) -> str:
        """Return ``<source>/<frame>``, or just ``<frame>`` for the world."""
        name = self._inspector.get_name(frame_id)
        if frame_id == self._inspector.world_frame_id():
            return name
        return f"{self.source_name(frame_id)}/{name}"

    def geometry_id(self, reference: GeometryReference | GeometryId | str | int) -> GeometryId:
        """Return the geometry with this id, path or bare name.

        Raises UnknownIdError for one that is not there, NameConflictError for a name that several
        geometries have.
        """
        if isinstance(reference, GeometryReference):
            reference = reference.id or reference.name
        if isinstance(reference, str):
            return _find(
                reference,
                self._geometry_paths,
                self._geometry_bare_names,
                "geometry",
                self.geometry_path,
            )
        geometry_id = self._geometries.get(int(reference))
        if geometry_id is None:
            raise UnknownIdError(f"there is no geometry with id {int(reference)}")
        return geometry_id

    def geometry_path(self, geometry_id: GeometryId | int) -> str:
        """Return ``<source>/<frame>/<name>``."""
        name = self.geometry_name(geometry_id)
        return f"{name.source}/{name.frame}/{name.name}"

    def geometry_name(self, geometry_id: GeometryId | int) -> GeometryName:
        """Return the message that names a geometry: shared, so don't change it.

        Raises UnknownIdError for an id that is not there.
        """
        name = self._names.get(int(geometry_id))
        if name is None:
            name = self._names[int(geometry_id)] = self._make_name(int(geometry_id))
        return name

    def _make_name(self, value: int) -> GeometryName:
        geometry_id = self.geometry_id(value)
        frame_id = self._inspector.get_frame_id(geometry_id)
        return GeometryName(
            id=value,
            frame_id=int(frame_id),
            source=self.source_name(geometry_id),
            frame=self._inspector.get_name(frame_id),
            name=self._inspector.get_name(geometry_id),
        )

    def legend(self, *columns: ArrayLike) -> GeometryNames:
        """Return the names of all ids in columns of ids, each once.

        Raises UnknownIdError for an id that is not there.
        """
        ids = np.concatenate([np.asarray(column, np.int64).ravel() for column in columns])
        # One object: threads that come first at once each make one, and rows are filled in one.
        table = self._columns
        rows = table.rows(ids, self.geometry_name)
        return GeometryNames(
            id=int64s_to_msg(table.id[rows]),
            frame_id=int64s_to_msg(table.frame_id[rows]),
            source=table.source[rows].tolist(),
            frame=table.frame[rows].tolist(),
            name=table.name[rows].tolist(),
        )

    @cached_property
    def _columns(self) -> _Columns:
        return _Columns(self._geometries)

    @cached_property
    def _sources(self) -> Mapping[str, SourceId]:
        return {self._inspector.get_name(s): s for s in self._inspector.get_all_source_ids()}

    @cached_property
    def _frame_paths(self) -> Mapping[str, list[FrameId]]:
        return _by_name(self._inspector.get_all_frame_ids(), self.frame_path)

    @cached_property
    def _frame_bare_names(self) -> Mapping[str, list[FrameId]]:
        return _by_name(self._inspector.get_all_frame_ids(), self._inspector.get_name)

    @cached_property
    def _geometries(self) -> Mapping[int, GeometryId]:
        return {int(g): g for g in self._inspector.get_all_geometry_ids()}

    @cached_property
    def _geometry_paths(self) -> Mapping[str, list[GeometryId]]:
        return _by_name(self._geometries.values(), self.geometry_path)

    @cached_property
    def _geometry_bare_names(self) -> Mapping[str, list[GeometryId]]:
        return _by_name(self._geometries.values(), self._inspector.get_name)


class _Columns:
    """Names of all geometries by row, sorted by id: legends of many are taken from it at once.

    A row is written when it is first asked for; two threads that do so at once write the same.
    """

    def __init__(self, ids: Iterable[int]) -> None:
        self.id = np.array(sorted(ids), dtype=np.int64)
        count = len(self.id)
        self.frame_id = np.zeros(count, dtype=np.int64)
        self.source, self.frame, self.name = np.empty((3, count), dtype=object)
        self._is_known = np.zeros(count, dtype=bool)

    def rows(
        self, ids: NDArray[np.int64], geometry_name: Callable[[int], GeometryName]
    ) -> NDArray[np.int64]:
        """Return the rows of ids, each once; ``geometry_name`` raises for one that has none."""
        places = np.searchsorted(self.id, ids)
        is_there = np.zeros(len(ids), dtype=bool)
        inside = places < len(self.id)
        is_there[inside] = self.id[places[inside]] == ids[inside]
        for value in ids[~is_there].tolist():
            geometry_name(value)
        is_asked = np.zeros(len(self.id), dtype=bool)
        is_asked[places] = True
        for row in np.flatnonzero(is_asked & ~self._is_known).tolist():
            name = geometry_name(int(self.id[row]))
            self.frame_id[row] = name.frame_id
            self.source[row], self.frame[row], self.name[row] = name.source, name.frame, name.name
            self._is_known[row] = True
        return np.flatnonzero(is_asked)


def legend(names: SceneNames | None, *columns: ArrayLike) -> GeometryNames:
    """Return the names of all ids in columns of ids; none where they are not wanted."""
    return GeometryNames() if names is None else names.legend(*columns)


def _by_name(ids: Iterable[T], name: Any) -> Mapping[str, list[T]]:
    result = defaultdict(list)
    for item in ids:
        between_steps()
        result[name(item)].append(item)
    return dict(result)


def _find(
    name: str,
    paths: Mapping[str, list[T]],
    bare_names: Mapping[str, list[T]],
    what: str,
    path: Any,
) -> T:
    meant = meant_name(name)
    found = paths.get(meant) or bare_names.get(meant) or []
    if not found:
        raise UnknownIdError(f"there is no {what} {quoted(name)}")
    if len(found) > 1:
        listed = ", ".join(f"{path(item)} (id {int(item)})" for item in found[:_LISTED])
        rest = f" and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
        raise NameConflictError(f"{what} {quoted(name)} is ambiguous: {listed}{rest}")
    return found[0]
