"""Which corner of a hull is probably nearest to a point, and how far others lie beyond it.

Eight lanes are in a register each, with all that is known of them, while the corners pass by.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.code import ARRAY, generated, PLACE
from scene_graph_ros.geometry.compiled.streams import LINE
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.tables.hull_blocks import vertex
from scene_graph_ros.geometry.tables.vertex_scan import GROUP

__all__ = ["scan_corners_of_hull", "scan_corners_of_tile"]

_TOGETHER = 2
"""Registers of lanes that each corner is shown to at once, so that they need not wait."""
_STRIDE = 4 * GROUP
_GROUP_BITS = 3
_POINT, _NEAREST, _WAY, _HEIGHT, _BEST, _REACH = (0, 7, 14, 17, 18, 19)
"""Numbers of a lane, as in ``hull_lanes``."""


def _along(corner, way):
    return corner[0] * way[0] + corner[1] * way[1] + corner[2] * way[2]


def _scan_plainly(lanes, corners):
    """Scan ``corners`` (k, 3, lanes); the others below say what is done."""
    numbers = lanes.reshape(-1, LANES)
    point = numbers[_POINT : _POINT + 3]
    best = np.argmax([_along(corner, point - corners[0]) for corner in corners], axis=0)
    nearest = corners[best, :, np.arange(LANES)].T
    way = point - nearest
    numbers[_NEAREST : _NEAREST + 3], numbers[_WAY : _WAY + 3] = nearest, way
    numbers[_BEST], numbers[_REACH] = best, _along(nearest, way)
    heights = [_along(corner, way) for corner in corners]
    numbers[_HEIGHT] = np.max([numbers[_REACH], *heights], axis=0)


def _scan_hull_plainly(lanes, blocks, first, count):
    places = [first + _STRIDE * (k // GROUP) + k % GROUP for k in range(count)]
    corners = np.array([vertex(blocks, place) for place in places])
    _scan_plainly(lanes, np.repeat(corners[:, :, None], LANES, axis=2))


def _scan_tile_plainly(lanes, corners, tile, count):
    _scan_plainly(lanes, corners[tile, :count])


class _Scan:
    """Writes the code for some registers of lanes; ``corner`` gives that of each, by number."""

    def __init__(self, code, lanes, first, corner):
        self._code, self._lanes, self._corner = code, lanes, corner
        self._firsts = [first + LINE * k for k in range(_TOGETHER)]

    def _place(self, number, k):
        return self._firsts[k] + number * LANES

    def _write(self, number, k, vectors):
        for axis, vector in enumerate(vectors):
            self._lanes.write(self._place(number + axis, k), vector)

    def _corners(self, number):
        return [self._corner(number, first) for first in self._firsts]

    def _way(self, k, corner):
        point = [self._lanes.vector(self._place(_POINT + axis, k), LINE) for axis in range(3)]
        return [p - c for p, c in zip(point, corner, strict=True)]

    def _keep(self, vectors):
        return [self._code.kept(vector) for vector in vectors]

    def _take(self, is_taken, vectors, kept):
        for vector, known in zip(vectors, kept, strict=True):
            known.write(self._code.select(is_taken, vector, known.read()))

    def _find(self, count):
        """Find the corner furthest along the way from the first one; return all of it, kept."""
        code, states, ways = self._code, [], []
        for k, corner in enumerate(self._corners(code.place(0))):
            way = self._way(k, corner)
            ways.append(way)
            zero = code.numbers(*[0.0] * LINE)
            states.append(self._keep([code.dot(corner, way), zero, *corner]))
        with code.loop(count, start=1) as index:
            number = code.repeated(code.real(index), LINE)
            corners = self._corners(index)
            for corner, way, state in zip(corners, ways, states, strict=True):
                height = code.dot(corner, way)
                is_higher = height > state[0].read()
                self._take(is_higher, [height, number, *corner], state)
        return states

    def _look_beyond(self, count, ways, reaches):
        """Return the height of the furthest corner along each way, kept."""
        code, heights = self._code, self._keep(reaches)
        with code.loop(count) as index:
            corners = self._corners(index)
            for corner, way, known in zip(corners, ways, heights, strict=True):
                height = code.dot(corner, way)
                self._take(height > known.read(), [height], [known])
        return heights

    def write(self, count):
        """Write all that ``scan_corners_of_hull`` finds."""
        code, ways, reaches = self._code, [], []
        for k, state in enumerate(self._find(count)):
            _, best, *corner = [known.read() for known in state]
            way = self._way(k, corner)
            reach = code.dot(corner, way)
            ways.append(way)
            reaches.append(reach)
            for number, vectors in ((_NEAREST, corner), (_WAY, way), (_BEST, [best])):
                self._write(number, k, vectors)
            self._write(_REACH, k, [reach])
        for k, known in enumerate(self._look_beyond(count, ways, reaches)):
            self._write(_HEIGHT, k, [known.read()])


def _scan(code, lanes, count, corner):
    with code.loop(code.place(LANES // (LINE * _TOGETHER))) as index:
        _Scan(code, lanes, index * (LINE * _TOGETHER), corner).write(count)


@generated(ARRAY, ARRAY, PLACE, PLACE, plain=_scan_hull_plainly)
def scan_corners_of_hull(code, lanes, blocks, first, count):
    """Look at ``count`` corners of a hull, whose first is at the place ``first`` of a block.

    For each lane is found the corner furthest along the way from the first one to the point,
    the first of several: its coordinates, its number, the way from it to the point, how far
    it lies along that way, and how far the furthest corner does.
    """

    def corner(number, _):
        at = first + ((number >> _GROUP_BITS) * _STRIDE + (number & (GROUP - 1)))
        return [code.repeated(blocks.number(at + GROUP * axis), LINE) for axis in range(3)]

    _scan(code, lanes, count, corner)


@generated(ARRAY, ARRAY, PLACE, PLACE, plain=_scan_tile_plainly)
def scan_corners_of_tile(code, lanes, corners, tile, count):
    """Do so with the first corners of each lane's hull, ``corners[tile, k, axis, lane]``."""
    start = tile * (corners.shape[1] * (3 * LANES))

    def corner(number, first):
        at = start + number * (3 * LANES)
        return [corners.vector(at + first + axis * LANES, LINE) for axis in range(3)]

    _scan(code, lanes, count, corner)
