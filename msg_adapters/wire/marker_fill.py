"""How markers follow one another in the bytes of an array of them."""

from __future__ import annotations

from functools import cache

from visualization_msgs.msg import Marker, MarkerArray, MeshFile

from msg_adapters.wire.layout import HEADER, layout

__all__ = ["ALIGNMENT", "COUNT", "FIRST", "MARKER_STAMPS", "gap_behind", "marker_before"]

ALIGNMENT = 8
"""Bytes of the largest field, after which the layout of a message repeats."""

COUNT = HEADER
"""Where the number of markers is."""

FIRST = COUNT + 4
"""Where the first marker begins."""

MARKER_STAMPS = "markers.header.stamp.sec"
"""The path of the stamps of an array's markers, with which each of them begins."""

_UNIT = 4
"""Bytes of the first field of a marker, the seconds of its stamp: it begins at a multiple."""


def gap_behind(position: int) -> int:
    """Return the bytes between a marker that ends at a position and the next one."""
    return -position % _UNIT


@cache
def marker_before(alignment: int) -> Marker:
    """Return a marker behind which, alone in an array, the next begins there modulo ALIGNMENT."""
    for length in range(ALIGNMENT):
        marker = Marker(mesh_file=MeshFile(data=bytes(length)))
        end = layout(MarkerArray(markers=[marker])).size
        if (end + gap_behind(end)) % ALIGNMENT == alignment:
            return marker
    raise ValueError(f"no marker begins at {alignment} modulo {ALIGNMENT}")
