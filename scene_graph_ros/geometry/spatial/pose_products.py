"""The product of two poses, four numbers at a time."""

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic

__all__ = ["compose_pose"]

_NUMBERS = 16
"""Numbers of a pose."""


def _compose_plainly(X_AB, i, X_BC, j, X_AC, k):
    x, y, z = [[X_BC[j, row, column] for column in range(4)] for row in range(3)]
    for row in range(3):
        r0, r1, r2, p = [X_AB[i, row, column] for column in range(4)]
        for column in range(4):
            offset = p if column == 3 else 0.0
            X_AC[k, row, column] = r0 * x[column] + r1 * y[column] + r2 * z[column] + offset
    for column in range(4):
        X_AC[k, 3, column] = 1.0 if column == 3 else 0.0


class _Composer:
    """Generates the code of ``compose_pose``."""

    def __init__(self, context, builder, signature):
        self._context, self._builder, self._kinds = context, builder, signature.args
        self._four = ir.VectorType(ir.DoubleType(), 4)

    def _place(self, argument, array, pose):
        """Return a pointer to the first number of a pose."""
        builder = self._builder
        data = self._context.make_array(self._kinds[argument])(self._context, builder, array).data
        return builder.gep(data, [builder.mul(pose, self._number(_NUMBERS))])

    def _number(self, value):
        return self._context.get_constant(types.intp, value)

    def _row(self, pose, row):
        place = self._builder.gep(pose, [self._number(4 * row)])
        return self._builder.bitcast(place, self._four.as_pointer())

    def _repeated(self, number):
        vector = self._builder.insert_element(
            ir.Constant(self._four, ir.Undefined), number, ir.Constant(ir.IntType(32), 0)
        )
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), 4), [0] * 4)
        return self._builder.shuffle_vector(vector, vector, zeros)

    def write(self, X_AB, i, X_BC, j, X_AC, k):
        builder = self._builder
        left, right, product = (
            self._place(0, X_AB, i),
            self._place(2, X_BC, j),
            self._place(4, X_AC, k),
        )
        axes = [builder.load(self._row(right, row), align=8) for row in range(3)]
        rows = []
        for row in range(3):
            numbers = [
                builder.load(builder.gep(left, [self._number(4 * row + column)]))
                for column in range(4)
            ]
            terms = [
                builder.fmul(self._repeated(number), axis)
                for number, axis in zip(numbers, axes, strict=False)
            ]
            offset = builder.insert_element(
                ir.Constant(self._four, [0.0] * 4), numbers[3], ir.Constant(ir.IntType(32), 3)
            )
            total = builder.fadd(builder.fadd(terms[0], terms[1]), terms[2])
            rows.append(builder.fadd(total, offset))
        rows.append(ir.Constant(self._four, [0.0, 0.0, 0.0, 1.0]))
        for row, numbers in enumerate(rows):
            builder.store(numbers, self._row(product, row), align=8)


if numba_config.DISABLE_JIT:
    compose_pose = _compose_plainly
else:

    @intrinsic
    def compose_pose(typing_context, X_AB, i, X_BC, j, X_AC, k):
        """Write ``X_AB[i] X_BC[j]`` to ``X_AC[k]``: rows of C-contiguous ``(n, 4, 4)`` arrays."""

        def lower(context, builder, signature, arguments):
            _Composer(context, builder, signature).write(*arguments)
            return context.get_dummy_value()

        kinds = (X_AB, types.intp, X_BC, types.intp, X_AC, types.intp)
        if not all(kind.layout == "C" for kind in kinds[::2]):
            return None
        return types.void(*kinds), lower
