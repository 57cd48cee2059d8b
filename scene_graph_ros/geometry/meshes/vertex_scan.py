"""Which of many points lies furthest along a direction, eight of them in step.

Points come in groups of GROUP: their x, then their y, then their z, then GROUP numbers that are
not looked at.
"""

from llvmlite import ir
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic
import numpy as np

__all__ = ["GROUP", "furthest_of_groups"]

GROUP = 8
_STRIDE = 4 * GROUP
_NUMBERS = ir.VectorType(ir.DoubleType(), GROUP)
_WORD = ir.IntType(64)
_PLACES = ir.VectorType(_WORD, GROUP)
_LANE = ir.IntType(32)


def _furthest_plainly(blocks, first, groups, x, y, z):
    points = blocks[first : first + _STRIDE * groups].reshape(groups, 4, GROUP)
    along = points[:, 0] * x + points[:, 1] * y + points[:, 2] * z
    group, lane = divmod(int(np.argmax(along)), GROUP)
    return first + _STRIDE * group + lane


def _repeated(builder, kind, number):
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), number, ir.Constant(_LANE, 0))
    zeros = ir.Constant(ir.VectorType(_LANE, GROUP), [0] * GROUP)
    return builder.shuffle_vector(one, one, zeros)


def _later(builder, heights, places, other_heights, other_places):
    """Return where others are to be taken: they are higher, or as high and before."""
    is_higher = builder.fcmp_ordered(">", other_heights, heights)
    is_tied = builder.fcmp_ordered("==", other_heights, heights)
    is_before = builder.icmp_signed("<", other_places, places)
    return builder.or_(is_higher, builder.and_(is_tied, is_before))


def _first_of_highest(builder, heights, places):
    """Return the place of the largest height, the lowest of several, by halving the vectors.

    The last two are compared as numbers: LLVM 22 drops a part of the comparison of vectors of
    which one element is taken.
    """
    for half in (GROUP // 2, GROUP // 4):
        order = [(lane + half) % GROUP for lane in range(GROUP)]
        mask = ir.Constant(ir.VectorType(_LANE, GROUP), order)
        others = builder.shuffle_vector(heights, heights, mask)
        other_places = builder.shuffle_vector(places, places, mask)
        is_other = _later(builder, heights, places, others, other_places)
        heights = builder.select(is_other, others, heights)
        places = builder.select(is_other, other_places, places)
    lanes = [ir.Constant(_LANE, lane) for lane in range(2)]
    height, other = [builder.extract_element(heights, lane) for lane in lanes]
    place, other_place = [builder.extract_element(places, lane) for lane in lanes]
    is_other = _later(builder, height, place, other, other_place)
    return builder.select(is_other, other_place, place)


def _scan(builder, data, first, groups, direction):
    def group(at, axis):
        place = builder.gep(data, [builder.add(at, ir.Constant(_WORD, GROUP * axis))])
        return builder.load(builder.bitcast(place, _NUMBERS.as_pointer()), align=8)

    axes = [_repeated(builder, _NUMBERS, number) for number in direction]

    def along(at):
        x, y, z = [builder.fmul(group(at, axis), axes[axis]) for axis in range(3)]
        return builder.fadd(builder.fadd(x, y), z)

    lanes = ir.Constant(_PLACES, list(range(GROUP)))
    best = cgutils.alloca_once_value(builder, along(first))
    where = cgutils.alloca_once_value(
        builder, builder.add(_repeated(builder, _PLACES, first), lanes)
    )
    with cgutils.for_range(builder, groups, start=ir.Constant(_WORD, 1)) as loop:
        at = builder.add(first, builder.mul(loop.index, ir.Constant(_WORD, _STRIDE)))
        heights, known = along(at), builder.load(best)
        is_higher = builder.fcmp_ordered(">", heights, known)
        builder.store(builder.select(is_higher, heights, known), best)
        places = builder.add(_repeated(builder, _PLACES, at), lanes)
        builder.store(builder.select(is_higher, places, builder.load(where)), where)
    return _first_of_highest(builder, builder.load(best), builder.load(where))


if numba_config.DISABLE_JIT:
    furthest_of_groups = _furthest_plainly
else:

    @intrinsic
    def furthest_of_groups(typing_context, blocks, first, groups, x, y, z):
        """Return the place of the x of the point furthest along (x, y, z), of at least one group.

        Of points that lie as far it is the first.
        """

        def lower(context, builder, signature, arguments):
            array, start, count, *direction = arguments
            data = context.make_array(signature.args[0])(context, builder, array).data
            return _scan(builder, data, start, count, direction)

        kinds = (blocks, types.intp, types.intp, *[types.float64] * 3)
        return (types.intp(*kinds), lower) if blocks.layout == "C" else None
