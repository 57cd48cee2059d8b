"""Numbers that compiled code computes in step, one of each of like problems: a lane.

Lanes are eight or four wide: as the widest registers, and half of that; ``WIDE`` ones are several
registers wide. They are written with the operators of numbers, so that functions of tuples of
numbers (see ``spatial.vectors``) take tuples of lanes as well, and ``root``, ``larger``,
``select`` and their like take single numbers. A number beside lanes stands for as many of itself;
``x[k]`` is the number of lane k. Both sides of a condition are computed for all lanes, and
``select`` picks. A lane never depends on the ones beside it, unless they are reordered. Arithmetic
is IEEE's, without fusion, as for single numbers. With ``NUMBA_DISABLE_JIT=1`` lanes are numpy's
arrays.

Places in arrays are counted flat; the arrays are C-contiguous.
"""

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.core.types import containers
from numba.extending import intrinsic
import numpy as np

from scene_graph_ros.geometry.compiled.lane_types import (
    are_numbers,
    LaneChoices,
    LaneNumbers,
    lower_of,
    lower_of_numbers,
    repeated,
    vectors_of,
)

__all__ = [
    "FOUR",
    "LANES",
    "WIDE",
    "all_of",
    "any_of",
    "as_lanes",
    "bits_of",
    "every",
    "every_four",
    "every_wide",
    "larger",
    "load_four",
    "load_lanes",
    "load_number",
    "load_wide",
    "lowest_bit",
    "magnitude",
    "merging",
    "reordering",
    "root",
    "select",
    "smaller",
    "store_choices",
    "store_lanes",
    "store_number",
    "stream_lanes",
    "with_sign",
]

LANES = 8
"""The width of lanes of like problems."""
FOUR = 4
"""The width of lanes that are the coordinates of one thing: three of them, and one to spare."""
WIDE = 4 * LANES
"""The width of lanes that wait for themselves, step by step: four of the widest registers, or
eight of half of that, of which one is computed while the others wait."""

_NUMBER_BYTES = 8


def _is_lanes(kind):
    return isinstance(kind, LaneNumbers)


def _is_flat(array, kind=types.float64):
    return isinstance(array, types.Array) and array.layout == "C" and array.dtype == kind


def _of_numbers(generate, count):
    """Make an intrinsic of so many numbers that returns lanes, or a number if none are lanes."""

    def typed(*kinds):
        kind = are_numbers(*kinds)
        if kind is None and all(given == types.float64 for given in kinds):
            return types.float64(*kinds), lower_of_numbers(generate)
        return None if kind is None else (kind(*kinds), lower_of(generate))

    # Numba counts names of parameters.
    if count == 1:
        return intrinsic(lambda typing_context, a: typed(a))
    return intrinsic(lambda typing_context, a, b: typed(a, b))


def _llvm(name):
    """Return a generator of calls of LLVM's function of that name, for vectors or numbers."""

    def generate(builder, *values):
        kind = values[0].type
        function = ir.FunctionType(kind, [kind] * len(values))
        width = f"v{kind.count}" if isinstance(kind, ir.VectorType) else ""
        full_name = f"llvm.{name}.{width}f64"
        return builder.call(builder.module.declare_intrinsic(full_name, fnty=function), values)

    return generate


def _told_of_choices(told):
    """Make an intrinsic that tells yes or no of choices; ``told`` compares their word of bits."""

    def generate(builder, choices):
        word = ir.IntType(choices.type.count)
        return builder.icmp_unsigned(*told(word, builder.bitcast(choices, word)))

    def typed(typing_context, a):
        is_right = isinstance(a, LaneChoices)
        return (types.boolean(a), lower_of(generate)) if is_right else None

    return intrinsic(typed)


def _at(context, builder, array, data, place, kind=None):
    """Return a pointer to a place of an array, as one to a ``kind`` of LLVM's if that is given."""
    pointer = builder.gep(context.make_array(array)(context, builder, data).data, [place])
    return pointer if kind is None else builder.bitcast(pointer, kind.as_pointer())


def _loader(width):
    """Make an intrinsic that returns so many numbers of an array."""
    vector = ir.VectorType(ir.DoubleType(), width)

    def lower(context, builder, signature, arguments):
        array, first = arguments
        pointer = _at(context, builder, signature.args[0], array, first, vector)
        return builder.load(pointer, align=_NUMBER_BYTES)

    def typed(typing_context, array, first):
        return (LaneNumbers(width)(array, types.intp), lower) if _is_flat(array) else None

    return intrinsic(typed)


def _repeater(width):
    """Make an intrinsic that returns so many lanes that all have one number."""

    def lower(context, builder, signature, arguments):
        return repeated(builder, arguments[0], width)

    return intrinsic(lambda typing_context, number: (LaneNumbers(width)(types.float64), lower))


def _storer(write, kind, of_array):
    """Make an intrinsic that writes lanes of a kind; ``write`` takes builder, value and address.

    ``of_array`` is the type of the array's elements.
    """

    def lower(context, builder, signature, arguments):
        array, first, vector = arguments
        kind_of_array = signature.args[0]
        write(builder, vector, lambda to: _at(context, builder, kind_of_array, array, first, to))
        return context.get_dummy_value()

    def typed(typing_context, array, first, lanes):
        is_right = isinstance(lanes, kind) and _is_flat(array, of_array)
        return (types.void(array, types.intp, lanes), lower) if is_right else None

    return intrinsic(typed)


def _store(builder, vector, pointer_to):
    builder.store(vector, pointer_to(vector.type), align=_NUMBER_BYTES)


def _stream(builder, vector, pointer_to):
    kind = vector.type
    written = builder.store(vector, pointer_to(kind), align=_NUMBER_BYTES * kind.count)
    one = builder.module.add_metadata([ir.Constant(ir.IntType(32), 1)])
    written.set_metadata("nontemporal", one)


def _store_bytes(builder, choices, pointer_to):
    kind = ir.VectorType(ir.IntType(8), choices.type.count)
    builder.store(builder.zext(choices, kind), pointer_to(kind), align=1)


def _shuffled(places):
    """Return a generator of the numbers at these indices of two vectors, one after the other."""
    mask = ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places))
    return lambda builder, x, y: builder.shuffle_vector(x, y, mask)


if numba_config.DISABLE_JIT:

    def every(number):
        """Return eight lanes that all have one number."""
        return np.full(LANES, number)

    def every_four(number):
        """Return four lanes that all have one number."""
        return np.full(FOUR, number)

    def every_wide(number):
        """Return wide lanes that all have one number."""
        return np.full(WIDE, number)

    def as_lanes(numbers):
        """Return lanes of the numbers of a tuple."""
        return np.array(numbers)

    def load_lanes(array, first):
        """Return eight numbers of an array."""
        return array.flat[first : first + LANES].copy()

    def load_four(array, first):
        """Return four numbers of an array."""
        return array.flat[first : first + FOUR].copy()

    def load_wide(array, first):
        """Return as many numbers of an array as wide lanes have."""
        return array.flat[first : first + WIDE].copy()

    def store_lanes(array, first, lanes):
        """Write lanes into an array."""
        array.flat[first : first + len(lanes)] = lanes

    stream_lanes = store_choices = store_lanes

    def load_number(array, place):
        """Return the number at a place of an array."""
        return array.flat[place]

    def store_number(array, place, number):
        """Write a number to a place of an array."""
        array.flat[place] = number

    def root(lanes):
        """Return the square roots."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(lanes)

    def larger(a, b):
        """Return the larger of the numbers of each lane; b where one is nan."""
        return np.where(a > b, a, b)

    def smaller(a, b):
        """Return the smaller of the numbers of each lane; b where one is nan."""
        return np.where(a < b, a, b)

    def reordering(*places):
        """Return an intrinsic for the numbers of lanes in another order."""
        return lambda lanes: lanes[list(places)]

    def merging(*places):
        """Return an intrinsic for numbers of two lanes, the second's after the first's."""
        return lambda a, b: np.concatenate([a, b])[list(places)]

    def select(choices, a, b):
        """Return a where a lane is chosen, else b; of single numbers one."""
        return np.where(choices, a, b)[()]

    def bits_of(choices):
        """Return an integer with a bit for each lane, from the lowest on: 1 where it is chosen."""
        return sum(1 << k for k in np.flatnonzero(choices).tolist())

    def lowest_bit(bits):
        """Return the place of the lowest bit that is 1; 64 where none is."""
        return (bits & -bits).bit_length() - 1 if bits else 64

    magnitude = np.abs
    with_sign = np.copysign
    any_of, all_of = np.any, np.all

else:

    @intrinsic
    def as_lanes(typing_context, numbers):
        """Return lanes of the numbers of a tuple."""
        if not isinstance(numbers, containers.UniTuple) or numbers.dtype != types.float64:
            return None
        kind = LaneNumbers(len(numbers))

        def lower(context, builder, signature, arguments):
            vector = ir.Constant(context.get_value_type(kind), ir.Undefined)
            for k in range(kind.width):
                number = builder.extract_value(arguments[0], k)
                vector = builder.insert_element(vector, number, ir.Constant(ir.IntType(32), k))
            return vector

        return kind(numbers), lower

    @intrinsic
    def bits_of(typing_context, choices):
        """Return an integer with a bit for each lane, from the lowest on: 1 where it is chosen."""
        if not isinstance(choices, LaneChoices):
            return None

        def lower(context, builder, signature, arguments):
            word = builder.bitcast(arguments[0], ir.IntType(choices.width))
            return builder.zext(word, ir.IntType(64))

        return types.int64(choices), lower

    @intrinsic
    def lowest_bit(typing_context, bits):
        """Return the place of the lowest bit that is 1; 64 where none is."""

        def lower(context, builder, signature, arguments):
            return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 0))

        return (types.int64(bits), lower) if bits == types.int64 else None

    @intrinsic
    def load_number(typing_context, array, place):
        """Return the number at a place of an array."""

        def lower(context, builder, signature, arguments):
            return builder.load(_at(context, builder, signature.args[0], *arguments))

        return (types.float64(array, types.intp), lower) if _is_flat(array) else None

    @intrinsic
    def store_number(typing_context, array, place, number):
        """Write a number to a place of an array."""

        def lower(context, builder, signature, arguments):
            *where, value = arguments
            builder.store(value, _at(context, builder, signature.args[0], *where))
            return context.get_dummy_value()

        kinds = (array, types.intp, types.float64)
        return (types.void(*kinds), lower) if _is_flat(array) else None

    @intrinsic
    def select(typing_context, choices, a, b):
        """Return a where a lane is chosen, else b; of single numbers one."""
        if choices == types.boolean and a == b == types.float64:
            return types.float64(choices, a, b), lower_of_numbers(lambda to, *of: to.select(*of))
        kind = LaneNumbers(choices.width) if isinstance(choices, LaneChoices) else None
        if kind is None or not {a, b} <= {kind, types.float64}:
            return None

        def lower(context, builder, signature, arguments):
            chosen, *values = arguments
            vectors = vectors_of(builder, signature.args[1:], values, kind.width)
            return builder.select(chosen, *vectors)

        return kind(choices, a, b), lower

    def reordering(*places):
        """Return a function for the numbers of lanes in another order."""
        shuffled = _shuffled(places)
        lower = lower_of(lambda builder, x: shuffled(builder, x, x))

        def typed(typing_context, lanes):
            return (LaneNumbers(len(places))(lanes), lower) if _is_lanes(lanes) else None

        return intrinsic(typed)

    def merging(*places):
        """Return a function for numbers of two lanes, the second's after the first's."""
        lower = lower_of(_shuffled(places))

        def typed(typing_context, a, b):
            return (LaneNumbers(len(places))(a, b), lower) if _is_lanes(a) and a == b else None

        return intrinsic(typed)

    every, every_four, every_wide = map(_repeater, (LANES, FOUR, WIDE))
    load_lanes, load_four, load_wide = map(_loader, (LANES, FOUR, WIDE))
    store_lanes = _storer(_store, LaneNumbers, types.float64)
    stream_lanes = _storer(_stream, LaneNumbers, types.float64)
    store_choices = _storer(_store_bytes, LaneChoices, types.boolean)
    root = _of_numbers(_llvm("sqrt"), 1)
    magnitude = _of_numbers(_llvm("fabs"), 1)
    with_sign = _of_numbers(_llvm("copysign"), 2)
    larger = _of_numbers(lambda b, x, y: b.select(b.fcmp_ordered(">", x, y), x, y), 2)
    smaller = _of_numbers(lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y), 2)
    any_of = _told_of_choices(lambda word, bits: ("!=", bits, ir.Constant(word, 0)))
    all_of = _told_of_choices(
        lambda word, bits: ("==", bits, ir.Constant(word, 2**word.width - 1))
    )
