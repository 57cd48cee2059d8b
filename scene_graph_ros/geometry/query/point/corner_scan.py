"""Which corner of a hull is probably nearest to a point, and how far others lie beyond it.

Eight lanes are in a register each, with all that is known of them, while the corners pass by.
"""

from llvmlite import ir
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic
import numpy as np

from scene_graph_ros.geometry.meshes.hull_blocks import vertex
from scene_graph_ros.geometry.meshes.vertex_scan import GROUP
from scene_graph_ros.geometry.query.point.lane_memory import LANES, LINE

__all__ = ["scan_corners_of_hull", "scan_corners_of_tile"]

_TOGETHER = 2
"""Registers of lanes that each corner is shown to at once, so that they need not wait."""
_STRIDE = 4 * GROUP
_WORD = ir.IntType(64)
_VECTOR = ir.VectorType(ir.DoubleType(), LINE)
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
    """Generates the code for some registers of lanes; ``corner`` gives that of each, by number."""

    def __init__(self, builder, data, first, corner):
        self._builder, self._data, self._corner = builder, data, corner
        self._firsts = [builder.add(first, _word(LINE * k)) for k in range(_TOGETHER)]

    def _place(self, number, k):
        at = self._builder.add(self._firsts[k], _word(number * LANES))
        place = self._builder.gep(self._data, [at])
        return self._builder.bitcast(place, _VECTOR.as_pointer())

    def _write(self, number, k, vectors):
        for axis, vector in enumerate(vectors):
            self._builder.store(vector, self._place(number + axis, k), align=8)

    def _corners(self, number):
        return [self._corner(number, first) for first in self._firsts]

    def _dot(self, a, b):
        x, y, z = [self._builder.fmul(p, q) for p, q in zip(a, b, strict=True)]
        return self._builder.fadd(self._builder.fadd(x, y), z)

    def _way(self, k, corner):
        point = [self._builder.load(self._place(_POINT + axis, k), align=8) for axis in range(3)]
        return [self._builder.fsub(p, c) for p, c in zip(point, corner, strict=True)]

    def _keep(self, vectors):
        return [cgutils.alloca_once_value(self._builder, vector) for vector in vectors]

    def _take(self, is_taken, vectors, kept):
        builder = self._builder
        for vector, known in zip(vectors, kept, strict=True):
            builder.store(builder.select(is_taken, vector, builder.load(known)), known)

    def _find(self, count):
        """Find the corner furthest along the way from the first one; return all of it, kept."""
        builder, states, ways = self._builder, [], []
        for k, corner in enumerate(self._corners(_word(0))):
            way = self._way(k, corner)
            ways.append(way)
            zero = ir.Constant(_VECTOR, [0.0] * LINE)
            states.append(self._keep([self._dot(corner, way), zero, *corner]))
        with cgutils.for_range(builder, count, start=_word(1)) as loop:
            number = _repeated(builder, builder.sitofp(loop.index, ir.DoubleType()))
            corners = self._corners(loop.index)
            for corner, way, state in zip(corners, ways, states, strict=True):
                height = self._dot(corner, way)
                is_higher = builder.fcmp_ordered(">", height, builder.load(state[0]))
                self._take(is_higher, [height, number, *corner], state)
        return states

    def _look_beyond(self, count, ways, reaches):
        """Return the height of the furthest corner along each way, kept."""
        builder = self._builder
        heights = self._keep(reaches)
        with cgutils.for_range(builder, count) as loop:
            corners = self._corners(loop.index)
            for corner, way, known in zip(corners, ways, heights, strict=True):
                height = self._dot(corner, way)
                is_higher = builder.fcmp_ordered(">", height, builder.load(known))
                self._take(is_higher, [height], [known])
        return heights

    def generate(self, count):
        builder, ways, reaches = self._builder, [], []
        for k, state in enumerate(self._find(count)):
            _, best, *corner = [builder.load(known) for known in state]
            way = self._way(k, corner)
            reach = self._dot(corner, way)
            ways.append(way)
            reaches.append(reach)
            for number, vectors in ((_NEAREST, corner), (_WAY, way), (_BEST, [best])):
                self._write(number, k, vectors)
            self._write(_REACH, k, [reach])
        for k, known in enumerate(self._look_beyond(count, ways, reaches)):
            self._write(_HEIGHT, k, [builder.load(known)])


def _word(value):
    return ir.Constant(_WORD, value)


def _repeated(builder, number):
    """Return a number in all places of a vector."""
    lane = ir.IntType(32)
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(lane, 0))
    zeros = ir.Constant(ir.VectorType(lane, LINE), [0] * LINE)
    return builder.shuffle_vector(one, one, zeros)


def _of_hull(builder, data, start):
    """Return what gives a corner of the hull whose vertices start at a place of its block."""

    def corner(number, first):
        group = builder.mul(builder.lshr(number, _word(3)), _word(_STRIDE))
        at = builder.add(start, builder.add(group, builder.and_(number, _word(GROUP - 1))))
        places = [builder.gep(data, [builder.add(at, _word(GROUP * axis))]) for axis in range(3)]
        return [_repeated(builder, builder.load(place)) for place in places]

    return corner


def _of_tile(builder, data, start):
    """Return what gives a corner of each lane's hull, given where those of a tile start."""

    def corner(number, first):
        at = builder.add(start, builder.mul(number, _word(3 * LANES)))
        result = []
        for axis in range(3):
            place = builder.gep(data, [builder.add(builder.add(at, first), _word(axis * LANES))])
            place = builder.bitcast(place, _VECTOR.as_pointer())
            result.append(builder.load(place, align=8))
        return result

    return corner


def _generate(builder, lanes, count, corner):
    steps = _word(LANES // (LINE * _TOGETHER))
    with cgutils.for_range(builder, steps) as loop:
        first = builder.mul(loop.index, _word(LINE * _TOGETHER))
        _Scan(builder, lanes, first, corner).generate(count)


if numba_config.DISABLE_JIT:
    scan_corners_of_hull, scan_corners_of_tile = _scan_hull_plainly, _scan_tile_plainly
else:

    def _data(context, builder, kinds, arrays):
        return [
            context.make_array(kind)(context, builder, array).data
            for kind, array in zip(kinds[:2], arrays[:2], strict=True)
        ]

    @intrinsic
    def scan_corners_of_hull(typing_context, lanes, blocks, first, count):
        """Look at ``count`` corners of a hull, whose first is at the place ``first`` of a block.

        For each lane is found the corner furthest along the way from the first one to the point,
        the first of several: its coordinates, its number, the way from it to the point, how far
        it lies along that way, and how far the furthest corner does.
        """

        def lower(context, builder, signature, arguments):
            data, vertices = _data(context, builder, signature.args, arguments)
            corner = _of_hull(builder, vertices, arguments[2])
            _generate(builder, data, arguments[3], corner)
            return context.get_dummy_value()

        return types.void(lanes, blocks, types.intp, types.intp), lower

    @intrinsic
    def scan_corners_of_tile(typing_context, lanes, corners, tile, count):
        """Do so with the first corners of each lane's hull, ``corners[tile, k, axis, lane]``."""

        def lower(context, builder, signature, arguments):
            data, vertices = _data(context, builder, signature.args, arguments)
            shape = context.make_array(signature.args[1])(context, builder, arguments[1]).shape
            room = builder.mul(builder.extract_value(shape, 1), _word(3 * LANES))
            corner = _of_tile(builder, vertices, builder.mul(arguments[2], room))
            _generate(builder, data, arguments[3], corner)
            return context.get_dummy_value()

        return types.void(lanes, corners, types.intp, types.intp), lower
