"""How near two boxes are, all axes of the world at a time."""

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic
import numpy as np

from scene_graph_ros.geometry.spatial.vector_code import numbers, VectorCode

__all__ = ["square_of_gap"]

_CORNER = 4
"""Numbers of a corner of a box: three coordinates, and one that nobody reads."""


def _square_plainly(lower, upper, i, j):
    gap = np.maximum(np.maximum(lower[i] - upper[j], lower[j] - upper[i])[:3], 0.0)
    return float(gap @ gap)


def _square(code, low_i, high_i, low_j, high_j):
    builder = code.builder
    gap = code.larger(builder.fsub(low_i, high_j), builder.fsub(low_j, high_i))
    gap = code.larger(gap, numbers(*[0.0] * 4))
    squares = code.product(gap, gap)
    x, y, z = [builder.extract_element(squares, ir.Constant(ir.IntType(32), k)) for k in range(3)]
    return builder.fadd(builder.fadd(x, y), z)


if numba_config.DISABLE_JIT:
    square_of_gap = _square_plainly
else:

    @intrinsic
    def square_of_gap(typing_context, lower, upper, i, j):
        """Return the square of the distance of two boxes, rows of (n, 4) corners (m^2)."""

        def generate(context, builder, signature, arguments):
            code = VectorCode(context, builder, signature)
            *corners, first, second = arguments
            boxes = [
                code.load(code.place(k, corners[k], row, _CORNER), 0)
                for row in (first, second)
                for k in range(2)
            ]
            return _square(code, *boxes)

        if lower.layout != "C" or upper.layout != "C":
            return None
        return types.float64(lower, upper, types.intp, types.intp), generate
