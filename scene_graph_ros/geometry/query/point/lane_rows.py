"""Turn answers that lie beside each other in lanes into rows of result columns.

Lanes hold the same number of many points; a column wants all rows of a point one after the other.
Eight by eight, numbers are turned in the processor's registers, so that every line of the cache is
read and written once.
"""

from llvmlite import ir
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic

from scene_graph_ros.geometry.meshes.scratch import LANE_ROWS, LANES

__all__ = ["ANSWER", "NUMBERS", "SQUARE", "put_square"]

NUMBERS = 8
"""Numbers of an answer: phi, p_GN, grad_W, and whether it is unique, 1 or 0."""
ANSWER = NUMBERS * LANES
"""Numbers of the answers of all lanes about one row, number k of lane j at ``k * LANES + j``."""
SQUARE = LANE_ROWS
"""Rows, and lanes, that are turned at once."""


def _put_plainly(answers, first, room, at, stride):
    phi, p_GN, grad_W, unique = room
    for lane in range(SQUARE):
        for row in range(SQUARE):
            to, k = at + lane * stride + row, first + row * ANSWER + lane
            phi[to], unique[to] = answers[k], answers[k + 7 * LANES] != 0.0
            for axis in range(3):
                p_GN[3 * to + axis] = answers[k + (1 + axis) * LANES]
                grad_W[3 * to + axis] = answers[k + (4 + axis) * LANES]


def _shuffle(builder, a, b, places):
    index = ir.VectorType(ir.IntType(32), len(places))
    return builder.shuffle_vector(a, b, ir.Constant(index, list(places)))


def _turned(builder, rows):
    """Return the columns of eight vectors of eight."""
    rows = list(rows)
    for step in (1, 2, 4):
        low = [p if not p & step else SQUARE + p - step for p in range(SQUARE)]
        high = [p + step if not p & step else SQUARE + p for p in range(SQUARE)]
        for k in range(SQUARE):
            if not k & step:
                a, b = rows[k], rows[k + step]
                rows[k], rows[k + step] = (
                    _shuffle(builder, a, b, low),
                    _shuffle(builder, a, b, high),
                )
    return rows


def _interleaved(builder, x, y, z):
    """Return x0, y0, z0, x1, ... in three vectors."""
    result = []
    for part in range(3):
        number = [divmod(SQUARE * part + p, 3) for p in range(SQUARE)]
        xy = [k + SQUARE * axis if axis < 2 else 0 for k, axis in number]
        xyz = [SQUARE + k if axis == 2 else p for p, (k, axis) in enumerate(number)]
        result.append(_shuffle(builder, _shuffle(builder, x, y, xy), z, xyz))
    return result


class _Writer:
    """Generates the code of ``put_square``."""

    def __init__(self, context, builder, signature, arguments):
        self.context, self.builder = context, builder
        self._arrays = [
            context.make_array(kind)(context, builder, array).data
            for kind, array in zip(
                [signature.args[0], *signature.args[2]],
                [arguments[0], *cgutils.unpack_tuple(builder, arguments[2])],
                strict=True,
            )
        ]
        self._first, self._at, self._stride = arguments[1], arguments[3], arguments[4]

    def _number(self, value):
        return self.context.get_constant(types.intp, value)

    def _load(self, number):
        """Return one number of the answers, as eight vectors of eight rows, one for each lane."""
        builder, rows = self.builder, []
        vector = ir.VectorType(ir.DoubleType(), SQUARE)
        for row in range(SQUARE):
            at = builder.add(self._first, self._number(row * ANSWER + number * LANES))
            place = builder.bitcast(builder.gep(self._arrays[0], [at]), vector.as_pointer())
            rows.append(builder.load(place, align=8))
        return _turned(builder, rows)

    def _store(self, column, at, vector, align):
        place = self.builder.gep(self._arrays[1 + column], [at])
        place = self.builder.bitcast(place, vector.type.as_pointer())
        self.builder.store(vector, place, align=align)

    def _rows(self):
        """Return the first row of each lane."""
        builder, row, rows = self.builder, self._at, []
        for _ in range(SQUARE):
            rows.append(row)
            row = builder.add(row, self._stride)
        return rows

    def write(self):
        builder, three = self.builder, self._number(3)
        for row, phi in zip(self._rows(), self._load(0), strict=True):
            self._store(0, row, phi, 8)
        for column, number in ((1, 1), (2, 4)):
            axes = [self._load(number + axis) for axis in range(3)]
            for row, *xyz in zip(self._rows(), *axes, strict=True):
                at = builder.mul(row, three)
                for part, vector in enumerate(_interleaved(builder, *xyz)):
                    self._store(column, builder.add(at, self._number(SQUARE * part)), vector, 8)
        zeros = ir.Constant(ir.VectorType(ir.DoubleType(), SQUARE), [0.0] * SQUARE)
        for row, unique in zip(self._rows(), self._load(7), strict=True):
            is_unique = builder.fcmp_unordered("!=", unique, zeros)
            self._store(3, row, builder.zext(is_unique, ir.VectorType(ir.IntType(8), SQUARE)), 1)


if numba_config.DISABLE_JIT:
    put_square = _put_plainly
else:

    @intrinsic
    def put_square(typing_context, answers, first, room, at, stride):
        """Put eight lanes' answers about eight rows into a room.

        The first lane is at ``answers[first]``, its first row goes to ``at``, the next rows after
        it, and the next lanes' rows ``stride`` further each. ``room`` is phi, p_GN, grad_W and
        unique, all flat.
        """

        def lower(context, builder, signature, arguments):
            _Writer(context, builder, signature, arguments).write()
            return context.get_dummy_value()

        return types.void(answers, first, room, at, stride), lower
