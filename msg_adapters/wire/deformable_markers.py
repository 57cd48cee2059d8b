"""Markers of deformable geometries as bytes, put behind those of rigid ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.deformable_markers import empty_marker
from msg_adapters.marker_rows import marker_id
from msg_adapters.poses import header_to_msg
from msg_adapters.wire.fields import Serializer
from msg_adapters.wire.layout import layout
from msg_adapters.wire.marker_fill import MARKER_STAMPS
from msg_adapters.wire.triangles import append_markers, Appendix, TriangleListWire
from scene_graph_ros.views.deformables import DeformableItem

__all__ = ["DeformableMarkers", "Positions"]


class Positions(NamedTuple):
    """Where the vertices of a driven mesh are."""

    version: Any
    """Something else for each configuration, and kept alive by it."""
    compute: Callable[[], Sequence[NDArray[np.float64]]]
    """Returns one array (n, 3), in metres."""


class _Known(NamedTuple):
    item: DeformableItem
    wire: TriangleListWire


class DeformableMarkers:
    """The markers of one role's deformable geometries, put behind those of rigid ones."""

    def __init__(self, serialize: Serializer, *, frame_id: str) -> None:
        """Place markers in ``frame_id``, the world."""
        self._serialize = serialize
        self._frame_id = frame_id
        self._known: dict[int, _Known] = {}
        self._sent: dict[int, Any] = {}
        self._stale: dict[tuple[str, int], None] = {}

    def set_items(self, items: Iterable[DeformableItem]) -> None:
        """Take over which geometries there are; those that vanished are deleted next time."""
        before, self._known = self._known, {}
        for item in items:
            key, old = item.item.geometry_id, before.get(item.item.geometry_id)
            if old is not None and old.item.item == item.item:
                self._known[key] = _Known(item, old.wire)
            else:
                marker = self._empty_marker(item)
                wire = TriangleListWire(self._serialize, marker, has_colors=False)
                self._known[key] = _Known(item, wire)
        names = {_name(known) for known in self._known.values()}
        for known in before.values():
            if _name(known) not in names:
                self._stale[_name(known)] = None
        for name in names:
            self._stale.pop(name, None)
        # An id whose mesh is another now is sent again.
        self._sent = {
            key: sent
            for key, sent in self._sent.items()
            if key in self._known and before[key].item.triangles is self._known[key].item.triangles
        }

    def append(
        self,
        data: bytes,
        positions: Mapping[int, Positions],
        stamp_ns: int,
        *,
        is_whole: bool,
    ) -> tuple[bytes, int]:
        """Put markers behind those in the bytes of an array; return it, and how many they are.

        ``positions`` are those of all items by id. Deletions come first; then all markers where
        ``is_whole``, else those in another configuration than when they were last put in.
        """
        appendices = [self._deletion(ns, number, stamp_ns) for ns, number in self._stale]
        self._stale.clear()
        for key, (item, wire) in self._known.items():
            now = positions[key]
            if is_whole or self._sent.get(key) is not now.version:
                self._sent[key] = now.version
                (p_WVs,) = now.compute()
                corners = self._corners(item, p_WVs)
                if len(corners):
                    appendices.append(_appendix(wire, corners, stamp_ns))
                else:
                    appendices.append(self._deletion(*_name(self._known[key]), stamp_ns))
        if not appendices:
            return data, 0
        return append_markers(data, appendices), len(appendices)

    def _empty_marker(self, item: DeformableItem) -> Marker:
        """Return the marker of an item, without its changing parts."""
        return empty_marker(item.item, self._frame_id)

    def _corners(self, item: DeformableItem, p_WVs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the marker's points of positions; without any it is deleted."""
        return p_WVs[item.triangles.ravel()]

    def _deletion(self, ns: str, number: int, stamp_ns: int) -> Appendix:
        def piece(before: Sequence[Marker], key: int) -> bytes:
            marker = Marker(ns=ns, id=number, action=Marker.DELETE)
            marker.header = header_to_msg(stamp_ns, self._frame_id)
            message = MarkerArray(markers=[*before, marker])
            return self._serialize(message)[layout(message).begins(MARKER_STAMPS)[-1] :]

        return piece


def _name(known: _Known) -> tuple[str, int]:
    item = known.item.item
    return item.group, marker_id(item.geometry_id)


def _appendix(
    wire: TriangleListWire, corners: NDArray[np.float64], stamp_ns: int
) -> Appendix:  # fmt: skip
    return lambda before, key: wire.data(corners, stamp_ns, before=before, key=key)
