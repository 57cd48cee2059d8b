"""Code of four numbers in step, for the few kernels for which the compiler finds none itself.

Arguments are C-contiguous arrays; intrinsics of numba place the code into kernels.
"""

from llvmlite import ir
from numba.core import types

__all__ = ["FOUR", "VectorCode", "numbers"]

FOUR = ir.VectorType(ir.DoubleType(), 4)
"""Four numbers in step."""
_NUMBERS = 16
"""Numbers of a pose."""


def numbers(*values):
    """Return a constant vector."""
    return ir.Constant(FOUR, list(values))


class VectorCode:
    """Generates code with rows of poses, or other four numbers, as vectors."""

    def __init__(self, context, builder, signature):
        self.context, self.builder, self._kinds = context, builder, signature.args

    def integer(self, value):
        """Return an integer constant."""
        return self.context.get_constant(types.intp, value)

    def place(self, argument, array, pose, size=_NUMBERS):
        """Return a pointer to the first number of a pose, or a row so long, in an argument."""
        data = self.context.make_array(self._kinds[argument])(self.context, self.builder, array)
        return self.builder.gep(
            data.data, [self.builder.mul(pose, self.context.get_constant(types.intp, size))]
        )

    def row(self, pose, row):
        """Return a pointer to a row of a pose."""
        return self.builder.bitcast(
            self.builder.gep(pose, [self.integer(4 * row)]), FOUR.as_pointer()
        )

    def load(self, pose, row):
        """Return a row of a pose."""
        return self.builder.load(self.row(pose, row), align=8)

    def number(self, start, place):
        """Return a number, four times."""
        return self.repeated(self.builder.load(self.builder.gep(start, [self.integer(place)])))

    def write(self, rows, pose):
        """Write the first three rows of a pose, and the last."""
        for row, vector in enumerate([*rows, numbers(0.0, 0.0, 0.0, 1.0)]):
            self.builder.store(vector, self.row(pose, row), align=8)

    def order(self, vector, places):
        """Return the numbers of a vector in another order."""
        return self.merged(vector, vector, places)

    def merged(self, first, second, places):
        """Return numbers of two vectors; those of the second have the places from 4 on."""
        mask = ir.Constant(ir.VectorType(ir.IntType(32), 4), list(places))
        return self.builder.shuffle_vector(first, second, mask)

    def repeated(self, number):
        """Return a number four times."""
        first = self.builder.insert_element(
            ir.Constant(FOUR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0)
        )
        return self.order(first, [0] * 4)

    def sum(self, vectors):
        """Return the sum of vectors, from the first on."""
        total = vectors[0]
        for vector in vectors[1:]:
            total = self.builder.fadd(total, vector)
        return total

    def product(self, a, b):
        """Return the products of numbers at the same places."""
        return self.builder.fmul(a, b)

    def magnitude(self, vector):
        """Return the numbers without their signs."""
        return self._call("llvm.fabs.v4f64", vector)

    def square_root(self, vector):
        """Return the square roots."""
        return self._call("llvm.sqrt.v4f64", vector)

    def _call(self, name, vector):
        function = self.builder.module.declare_intrinsic(name, fnty=ir.FunctionType(FOUR, [FOUR]))
        return self.builder.call(function, [vector])

    def smaller(self, a, b):
        """Return the smaller of the numbers at the same places; b where one is nan."""
        return self.builder.select(self.builder.fcmp_ordered("<", a, b), a, b)

    def larger(self, a, b):
        """Return the larger of the numbers at the same places; b where one is nan."""
        return self.builder.select(self.builder.fcmp_ordered(">", a, b), a, b)

    def all_within(self, pairs):
        """Return whether all numbers of vectors are at most the limits beside them; nan is not."""
        within = [self.builder.fcmp_ordered("<=", vector, limit) for vector, limit in pairs]
        total = within[0]
        for some in within[1:]:
            total = self.builder.and_(total, some)
        bits = self.builder.bitcast(total, ir.IntType(4))
        return self.builder.icmp_unsigned("==", bits, ir.Constant(ir.IntType(4), 15))
