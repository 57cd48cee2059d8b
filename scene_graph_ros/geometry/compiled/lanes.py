"""Eight numbers that compiled code computes in step: one of each of eight like problems, a lane.

Written with the operators of numbers, so that functions of tuples of numbers (see
``spatial.vectors``) take tuples of lanes as well. What depends on a condition is computed for all
lanes, and ``select`` picks; a lane never depends on the ones beside it. Arithmetic is IEEE's,
without fusion, as for single numbers. With ``NUMBA_DISABLE_JIT=1`` lanes are numpy's arrays.
"""

import operator

from llvmlite import ir
from numba.core import types
import numba.core.config as numba_config
from numba.extending import intrinsic, models, overload, register_model
import numpy as np

from scene_graph_ros.geometry.compiled.code import repeated

__all__ = [
    "LANES",
    "all_of",
    "any_of",
    "every",
    "load_lanes",
    "load_number",
    "magnitude",
    "root",
    "select",
    "store_lanes",
    "store_number",
    "with_sign",
]

LANES = 8

_NUMBERS = ir.VectorType(ir.DoubleType(), LANES)
_CHOICES = ir.VectorType(ir.IntType(1), LANES)
_BITS = ir.IntType(LANES)


class _LaneNumbers(types.Type):
    def __init__(self):
        super().__init__(name=f"LaneNumbers({LANES})")


class _LaneChoices(types.Type):
    def __init__(self):
        super().__init__(name=f"LaneChoices({LANES})")


_numbers = _LaneNumbers()
_choices = _LaneChoices()


@register_model(_LaneNumbers)
class _NumbersModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, _NUMBERS)


@register_model(_LaneChoices)
class _ChoicesModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, _CHOICES)


def _lower(generate):
    """Return numba's function that generates code of vectors; single numbers are repeated."""

    def lower(context, builder, signature, arguments):
        vectors = [
            repeated(builder, value, LANES) if isinstance(kind, types.Float) else value
            for kind, value in zip(signature.args, arguments, strict=True)
        ]
        return generate(builder, *vectors)

    return lower


def _of_one(generate, kind=_numbers, result=_numbers):
    """Make an intrinsic of one argument; ``generate`` takes a builder and vectors."""

    def typer(typing_context, a):
        return (result(a), _lower(generate)) if a == kind else None

    return intrinsic(typer)


def _are_numbers(*kinds):
    """Return whether the types are numbers, some of them lanes."""
    return _numbers in kinds and all(k == _numbers or isinstance(k, types.Float) for k in kinds)


def _of_two(generate, result=_numbers):
    """Make an intrinsic of two arguments, one of them lanes at least."""

    def typer(typing_context, a, b):
        return (result(a, b), _lower(generate)) if _are_numbers(a, b) else None

    return intrinsic(typer)


def _are_choices(*kinds):
    return all(kind == _choices for kind in kinds)


def _of_choices(generate):
    """Make an intrinsic of two choices."""

    def typer(typing_context, a, b):
        return (_choices(a, b), _lower(generate)) if _are_choices(a, b) else None

    return intrinsic(typer)


def _overload(operation, code, are_right):
    """Let an operator mean an intrinsic, for arguments of the right types."""

    @overload(operation)
    def of_lanes(a, b):
        return (lambda a, b: code(a, b)) if are_right(a, b) else None  # noqa: PLW0108 - numba's form


def _call(builder, name, *vectors):
    kind = ir.FunctionType(_NUMBERS, [_NUMBERS] * len(vectors))
    return builder.call(builder.module.declare_intrinsic(name, fnty=kind), vectors)


def _place(context, builder, signature, arguments):
    data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
    return builder.bitcast(builder.gep(data, [arguments[1]]), _NUMBERS.as_pointer())


def _bits(builder, choices):
    return builder.bitcast(choices, _BITS)


if numba_config.DISABLE_JIT:

    def every(number):
        """Return lanes that all have one number."""
        return np.full(LANES, number)

    def load_lanes(array, first):
        """Return eight numbers of an array, counted flat."""
        return array.flat[first : first + LANES].copy()

    def store_lanes(array, first, lanes):
        """Write eight numbers into an array, counted flat."""
        array.flat[first : first + LANES] = lanes

    def load_number(array, place):
        """Return the number at a place of an array, counted flat."""
        return array.flat[place]

    def store_number(array, place, number):
        """Write a number to a place of an array, counted flat."""
        array.flat[place] = number

    def root(lanes):
        """Return the square roots."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(lanes)

    magnitude = np.abs
    with_sign = np.copysign
    select = np.where
    any_of, all_of = np.any, np.all

else:

    @intrinsic
    def every(typing_context, number):
        """Return lanes that all have one number."""

        def lower(context, builder, signature, arguments):
            return repeated(builder, arguments[0], LANES)

        return _numbers(types.float64), lower

    @intrinsic
    def load_lanes(typing_context, array, first):
        """Return eight numbers of a contiguous array, counted flat."""

        def lower(context, builder, signature, arguments):
            return builder.load(_place(context, builder, signature, arguments), align=8)

        return _numbers(array, types.intp), lower

    @intrinsic
    def store_lanes(typing_context, array, first, lanes):
        """Write eight numbers into a contiguous array, counted flat."""

        def lower(context, builder, signature, arguments):
            place = _place(context, builder, signature, arguments)
            builder.store(arguments[2], place, align=8)
            return context.get_dummy_value()

        return types.void(array, types.intp, _numbers), lower

    @intrinsic
    def load_number(typing_context, array, place):
        """Return the number at a place of a contiguous array, counted flat."""

        def lower(context, builder, signature, arguments):
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            return builder.load(builder.gep(data, [arguments[1]]))

        return types.float64(array, types.intp), lower

    @intrinsic
    def store_number(typing_context, array, place, number):
        """Write a number to a place of a contiguous array, counted flat."""

        def lower(context, builder, signature, arguments):
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            builder.store(arguments[2], builder.gep(data, [arguments[1]]))
            return context.get_dummy_value()

        return types.void(array, types.intp, types.float64), lower

    @intrinsic
    def select(typing_context, choices, a, b):
        """Return a where a lane is chosen, else b."""

        def lower(context, builder, signature, arguments):
            chosen = arguments[0]
            return _lower(lambda _, x, y: builder.select(chosen, x, y))(
                context, builder, types.none(*signature.args[1:]), arguments[1:]
            )

        is_right = choices == _choices and _are_numbers(a, b)
        return (_numbers(choices, a, b), lower) if is_right else None

    root = _of_one(lambda b, x: _call(b, f"llvm.sqrt.v{LANES}f64", x))
    magnitude = _of_one(lambda b, x: _call(b, f"llvm.fabs.v{LANES}f64", x))
    with_sign = _of_two(lambda b, x, y: _call(b, f"llvm.copysign.v{LANES}f64", x, y))
    any_of = _of_one(
        lambda b, x: b.icmp_unsigned("!=", _bits(b, x), ir.Constant(_BITS, 0)),
        _choices,
        types.boolean,
    )
    all_of = _of_one(
        lambda b, x: b.icmp_unsigned("==", _bits(b, x), ir.Constant(_BITS, 2**LANES - 1)),
        _choices,
        types.boolean,
    )

    for _operation, _generate in (
        (operator.add, lambda b, x, y: b.fadd(x, y)),
        (operator.sub, lambda b, x, y: b.fsub(x, y)),
        (operator.mul, lambda b, x, y: b.fmul(x, y)),
        (operator.truediv, lambda b, x, y: b.fdiv(x, y)),
    ):
        _overload(_operation, _of_two(_generate), _are_numbers)
    for _operation, _sign in (
        (operator.lt, "<"),
        (operator.le, "<="),
        (operator.gt, ">"),
        (operator.ge, ">="),
        (operator.eq, "=="),
    ):
        _compare = _of_two(lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y), _choices)
        _overload(_operation, _compare, _are_numbers)
    for _operation, _generate in (
        (operator.and_, lambda b, x, y: b.and_(x, y)),
        (operator.or_, lambda b, x, y: b.or_(x, y)),
    ):
        _overload(_operation, _of_choices(_generate), _are_choices)

    _inverse = _of_one(lambda b, x: b.not_(x), _choices, _choices)
    _negative = _of_one(lambda b, x: b.fneg(x))

    @overload(operator.invert)
    def _inverted(a):
        return (lambda a: _inverse(a)) if a == _choices else None  # noqa: PLW0108 - numba's form

    @overload(operator.neg)
    def _negated(a):
        return (lambda a: _negative(a)) if a == _numbers else None  # noqa: PLW0108
