"""Turn numbers that lie beside each other in lanes into rows of columns, and the other way.

Lanes hold the same number of many points or shapes; a column wants all rows of a point one after
the other, and a pose is a row of its own. Eight by eight, numbers are turned in the processor's
registers, so that every line of the cache is read and written once.
"""

from scene_graph_ros.geometry.compiled.code import ARRAY, ARRAYS, generated, PLACE
from scene_graph_ros.geometry.query.point.lane_memory import LANE_ROWS, LANES

__all__ = ["ANSWER", "SQUARE", "put_square", "stream_square", "take_square"]

_NUMBERS = 8
"""Numbers of an answer: phi, p_GN, grad_W, and whether it is unique, 1 or 0."""
ANSWER = _NUMBERS * LANES
"""Numbers of the answers of all lanes about one row, number k of lane j at ``k * LANES + j``."""
SQUARE = LANE_ROWS
"""Rows, and lanes, that are turned at once."""

_POSE = 16
_UNIQUE = 7
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


def _both_halves(code, array, at, other, half):
    """Return half of the vectors at two places, as one."""
    width = SQUARE // 2
    halves = [array.vector(start + half * width, width) for start in (at, other)]
    return code.merged(*halves, range(SQUARE))


def _turned(code, array, places):
    """Return the eight columns of the vectors that begin at eight places of an array."""
    columns = []
    for half in (0, 1):
        # Taking halves from memory is no work for the one unit that shuffles.
        rows = [_both_halves(code, array, places[k], places[k + 4], half) for k in range(4)]
        even, odd = [
            [code.merged(rows[k], rows[k + 1], order) for k in (0, 2)]
            for order in ((0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15))
        ]
        for order in ((0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)):
            columns += [code.merged(two[0], two[1], order) for two in (even, odd)]
    return columns


class _Writer:
    """Writes the code of ``put_square`` and ``stream_square``."""

    def __init__(self, code, answers, first, columns, at, stride):
        self._code, self._answers, self._first, self._columns = code, answers, first, columns
        self._rows = [at]
        """The first row of each lane."""
        for _ in range(SQUARE - 1):
            self._rows.append(self._rows[-1] + stride)

    def _place_of(self, row, number):
        return self._first + (row * ANSWER + number * LANES)

    def _write_numbers(self, column, first, width, is_streamed):
        """Write ``width`` numbers of each row, from the number ``first`` of an answer on."""
        order = [divmod(k, width) for k in range(SQUARE * width)]
        starts = [row * width for row in self._rows]
        write = self._columns[column].stream if is_streamed else self._columns[column].write
        for part in range(width):
            places = [
                self._place_of(row, first + axis)
                for row, axis in order[SQUARE * part : SQUARE * (part + 1)]
            ]
            vectors = _turned(self._code, self._answers, places)
            for start, vector in zip(starts, vectors, strict=True):
                write(start + SQUARE * part, vector)

    def _all_are_unique(self):
        places = [self._place_of(row, _UNIQUE) for row in range(SQUARE)]
        everywhere, *more = [self._answers.vector(at, SQUARE).differs(0.0) for at in places]
        for is_unique in more:
            everywhere = everywhere & is_unique
        return self._code.all_of(everywhere)

    def _write_flags(self):
        unique, code = self._columns[3], self._code
        with code.if_likely(self._all_are_unique()) as (then, otherwise):
            with then:
                for row in self._rows:
                    unique.write_bytes(row, code.place(_ALL_UNIQUE))
            with otherwise:
                places = [self._place_of(row, _UNIQUE) for row in range(SQUARE)]
                vectors = _turned(code, self._answers, places)
                for row, vector in zip(self._rows, vectors, strict=True):
                    unique.write_bytes(row, code.as_bytes(vector.differs(0.0)))

    def write(self, *, is_streamed):
        """Write all columns."""
        for column, first, width in ((0, 0, 1), (1, 1, 3), (2, 4, 3)):
            self._write_numbers(column, first, width, is_streamed)
        self._write_flags()


@generated(ARRAY, PLACE, ARRAYS, PLACE, PLACE, plain=_put_plainly)
def put_square(code, answers, first, columns, at, stride):
    """Put eight lanes' answers about eight rows into columns.

    The first lane is at ``answers[first]``, its first row goes to ``at``, the next rows after
    it, and the next lanes' rows ``stride`` further each. The columns are phi, p_GN, grad_W
    and unique, all flat.
    """
    _Writer(code, answers, first, columns, at, stride).write(is_streamed=False)


@generated(ARRAY, PLACE, ARRAYS, PLACE, PLACE, plain=_put_plainly)
def stream_square(code, answers, first, columns, at, stride):
    """Put answers as ``put_square`` does, past the caches.

    Each lane's first row has to begin a line in each column of numbers. Nobody may read
    before ``finish_streams``.
    """
    _Writer(code, answers, first, columns, at, stride).write(is_streamed=True)


@generated(ARRAY, ARRAY, PLACE, PLACE, ARRAY, PLACE, plain=_take_plainly)
def take_square(code, X, rows, at, number, poses, to):
    """Write eight numbers of eight poses as lanes, the first ones to ``poses[to]``.

    The poses are those of the eight rows from ``at`` on in ``rows``, counted flat, and the
    numbers are those from ``number`` on. All arrays are C-contiguous.
    """
    places = [rows.number(at + lane) * _POSE + number for lane in range(SQUARE)]
    for k, vector in enumerate(_turned(code, X, places)):
        poses.write(to + k * LANES, vector)
