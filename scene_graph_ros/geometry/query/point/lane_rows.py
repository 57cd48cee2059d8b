"""Turn numbers that lie beside each other in lanes into rows of columns, and the other way.

Lanes hold the same number of many points or shapes; a column wants all rows of a point one after
the other, and a pose is a row of its own. Eight by eight, numbers are turned in the processor's
registers, so that every line of the cache is read and written once.
"""

from llvmlite import ir
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic

from scene_graph_ros.geometry.query.point.lane_memory import LANE_ROWS, LANES

__all__ = ["ANSWER", "SQUARE", "put_square", "stream_square", "take_square"]

_NUMBERS = 8
"""Numbers of an answer: phi, p_GN, grad_W, and whether it is unique, 1 or 0."""
ANSWER = _NUMBERS * LANES
"""Numbers of the answers of all lanes about one row, number k of lane j at ``k * LANES + j``."""
SQUARE = LANE_ROWS
"""Rows, and lanes, that are turned at once."""

_POSE = 16
_WORD = ir.IntType(64)
_BYTE = ir.IntType(8)
_FLAGS = ir.VectorType(_BYTE, SQUARE)
_VECTOR = ir.VectorType(ir.DoubleType(), SQUARE)
_HALF = ir.VectorType(ir.DoubleType(), SQUARE // 2)
_ALL_UNIQUE = 0x0101010101010101


def _put_plainly(answers, first, columns, at, stride):
    phi, p_GN, grad_W, unique = columns
    for lane in range(SQUARE):
        for row in range(SQUARE):
            to, k = at + lane * stride + row, first + row * ANSWER + lane
            phi[to], unique[to] = answers[k], answers[k + 7 * LANES] != 0.0
            for axis in range(3):
                p_GN[3 * to + axis] = answers[k + (1 + axis) * LANES]
                grad_W[3 * to + axis] = answers[k + (4 + axis) * LANES]


def _take_plainly(X, rows, at, number, poses, to):
    for lane in range(SQUARE):
        given = X[rows.flat[at + lane]].flat[number : number + SQUARE]
        poses[to + lane :: LANES][:SQUARE] = given


class _Code:
    """Generates code about arguments that are C-contiguous arrays."""

    def __init__(self, context, builder):
        self.context, self.builder = context, builder

    def number(self, value):
        return self.context.get_constant(types.intp, value)

    def data(self, kind, array):
        return self.context.make_array(kind)(self.context, self.builder, array).data

    def _shuffle(self, a, b, places):
        index = ir.VectorType(ir.IntType(32), len(places))
        return self.builder.shuffle_vector(a, b, ir.Constant(index, list(places)))

    def _place(self, data, at, kind):
        return self.builder.bitcast(self.builder.gep(data, [at]), kind.as_pointer())

    def _both_halves(self, data, at, other, half):
        """Return half of the vectors at two places, as one."""
        halves = []
        for start in (at, other):
            start = self.builder.add(start, self.number(half * SQUARE // 2))
            halves.append(self.builder.load(self._place(data, start, _HALF), align=8))
        return self._shuffle(halves[0], halves[1], range(SQUARE))

    def turned(self, data, places):
        """Return the eight columns of the vectors that begin at eight places of an array."""
        columns = []
        for half in (0, 1):
            # Taking halves from memory is no work for the one unit that shuffles.
            rows = [self._both_halves(data, places[k], places[k + 4], half) for k in range(4)]
            even = [
                self._shuffle(rows[k], rows[k + 1], (0, 8, 2, 10, 4, 12, 6, 14)) for k in (0, 2)
            ]
            odd = [
                self._shuffle(rows[k], rows[k + 1], (1, 9, 3, 11, 5, 13, 7, 15)) for k in (0, 2)
            ]
            for order in ((0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)):
                columns += [self._shuffle(two[0], two[1], order) for two in (even, odd)]
        return columns

    def store(self, vector, data, at, is_streamed=False):
        place = self._place(data, at, vector.type)
        if is_streamed:
            written = self.builder.store(vector, place, align=64)
            one = self.builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)])
            written.set_metadata("nontemporal", one)
        else:
            self.builder.store(vector, place, align=8)


class _Writer(_Code):
    """Generates the code of ``put_square`` and ``stream_square``."""

    def __init__(self, context, builder, signature, arguments, is_streamed):
        super().__init__(context, builder)
        columns = cgutils.unpack_tuple(builder, arguments[2])
        self._answers = self.data(signature.args[0], arguments[0])
        self._columns = [
            self.data(kind, column)
            for kind, column in zip(signature.args[2], columns, strict=True)
        ]
        self._first, self._at, self._stride = arguments[1], arguments[3], arguments[4]
        self._is_streamed = is_streamed

    def _place_of(self, row, number):
        offset = row * ANSWER + number * LANES
        return self.builder.add(self._first, self.number(offset))

    def _rows(self):
        """Return the first row of each lane."""
        rows = [self._at]
        for _ in range(SQUARE - 1):
            rows.append(self.builder.add(rows[-1], self._stride))
        return rows

    def _write_numbers(self, column, first, width, rows):
        """Write ``width`` numbers of each row, from the number ``first`` of an answer on."""
        order = [divmod(k, width) for k in range(SQUARE * width)]
        starts = [self.builder.mul(row, self.number(width)) for row in rows]
        for part in range(width):
            places = [
                self._place_of(row, first + axis)
                for row, axis in order[SQUARE * part : SQUARE * (part + 1)]
            ]
            vectors = self.turned(self._answers, places)
            for start, vector in zip(starts, vectors, strict=True):
                at = self.builder.add(start, self.number(SQUARE * part))
                self.store(vector, self._columns[column], at, self._is_streamed)

    def _all_are_unique(self):
        zeros = ir.Constant(_VECTOR, [0.0] * SQUARE)
        everywhere = ir.Constant(_BYTE, -1)
        for row in range(SQUARE):
            place = self._place(self._answers, self._place_of(row, 7), _VECTOR)
            is_unique = self.builder.fcmp_unordered("!=", self.builder.load(place, align=8), zeros)
            everywhere = self.builder.and_(everywhere, self.builder.bitcast(is_unique, _BYTE))
        return self.builder.icmp_unsigned("==", everywhere, ir.Constant(_BYTE, -1))

    def _write_flags(self, rows):
        unique, zeros = self._columns[3], ir.Constant(_VECTOR, [0.0] * SQUARE)
        with self.builder.if_else(self._all_are_unique(), likely=True) as (then, otherwise):
            with then:
                for row in rows:
                    place = self._place(unique, row, _WORD)
                    self.builder.store(ir.Constant(_WORD, _ALL_UNIQUE), place, align=1)
            with otherwise:
                places = [self._place_of(row, 7) for row in range(SQUARE)]
                for row, vector in zip(rows, self.turned(self._answers, places), strict=True):
                    flags = self.builder.fcmp_unordered("!=", vector, zeros)
                    flags = self.builder.zext(flags, _FLAGS)
                    self.builder.store(flags, self._place(unique, row, _FLAGS), align=1)

    def write(self):
        rows = self._rows()
        for column, first, width in ((0, 0, 1), (1, 1, 3), (2, 4, 3)):
            self._write_numbers(column, first, width, rows)
        self._write_flags(rows)


def _take(context, builder, signature, arguments):
    code = _Code(context, builder)
    X, rows, poses = [code.data(signature.args[k], arguments[k]) for k in (0, 1, 4)]
    at, number, to = arguments[2], arguments[3], arguments[5]
    places = []
    for lane in range(SQUARE):
        row = builder.load(builder.gep(rows, [builder.add(at, code.number(lane))]))
        places.append(builder.add(builder.mul(row, code.number(_POSE)), number))
    for k, vector in enumerate(code.turned(X, places)):
        code.store(vector, poses, builder.add(to, code.number(k * LANES)))


if numba_config.DISABLE_JIT:
    put_square, stream_square, take_square = _put_plainly, _put_plainly, _take_plainly
else:

    def _writing(is_streamed):
        def lower(context, builder, signature, arguments):
            _Writer(context, builder, signature, arguments, is_streamed).write()
            return context.get_dummy_value()

        return lower

    @intrinsic
    def put_square(typing_context, answers, first, columns, at, stride):
        """Put eight lanes' answers about eight rows into columns.

        The first lane is at ``answers[first]``, its first row goes to ``at``, the next rows after
        it, and the next lanes' rows ``stride`` further each. The columns are phi, p_GN, grad_W
        and unique, all flat.
        """
        return types.void(answers, first, columns, at, stride), _writing(is_streamed=False)

    @intrinsic
    def stream_square(typing_context, answers, first, columns, at, stride):
        """Put answers as ``put_square`` does, past the caches.

        Each lane's first row has to begin a line in each column of numbers. Nobody may read
        before ``finish_streams``.
        """
        return types.void(answers, first, columns, at, stride), _writing(is_streamed=True)

    @intrinsic
    def take_square(typing_context, X, rows, at, number, poses, to):
        """Write eight numbers of eight poses as lanes, the first ones to ``poses[to]``.

        The poses are those of the eight rows from ``at`` on in ``rows``, counted flat, and the
        numbers are those from ``number`` on. All arrays are C-contiguous.
        """

        def lower(context, builder, signature, arguments):
            _take(context, builder, signature, arguments)
            return context.get_dummy_value()

        kinds = (X, rows, types.intp, types.intp, poses, types.intp)
        return types.void(*kinds), lower
