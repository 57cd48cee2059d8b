"""The types of numbers in step, and of choices among them, with the operators of numbers.

Each type has a width. Operators become one instruction each, where they stand: no function of
their own is compiled for them.
"""

from __future__ import annotations

from collections.abc import Callable
import operator
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import lower_builtin, models, register_model, type_callable

__all__ = [
    "LaneChoices",
    "LaneNumbers",
    "are_numbers",
    "lower_of",
    "lower_of_numbers",
    "repeated",
    "vectors_of",
]

_INDEX = ir.IntType(32)


class LaneNumbers(types.Type):
    """Float64 numbers in step."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"LaneNumbers({width})")


class LaneChoices(types.Type):
    """Yes or no, in step."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"LaneChoices({width})")


@register_model(LaneNumbers)
class _NumbersModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, ir.VectorType(ir.DoubleType(), fe_type.width))


@register_model(LaneChoices)
class _ChoicesModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, ir.VectorType(ir.IntType(1), fe_type.width))


def repeated(builder: Any, number: Any, width: int) -> Any:
    """Return a vector, in LLVM's form, of one number."""
    undefined = ir.Constant(ir.VectorType(number.type, width), ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(_INDEX, 0))
    zeros = ir.Constant(ir.VectorType(_INDEX, width), [0] * width)
    return builder.shuffle_vector(one, one, zeros)


def are_numbers(*kinds: Any) -> Any:
    """Return the type of the lanes among numbers of one width, None where something else is."""
    lanes = {kind for kind in kinds if isinstance(kind, LaneNumbers)}
    others = {kind for kind in kinds if not isinstance(kind, LaneNumbers)}
    return lanes.pop() if len(lanes) == 1 and others <= {types.float64} else None


def vectors_of(builder: Any, kinds: Any, values: Any, width: int | None = None) -> list[Any]:
    """Return the vectors, in LLVM's form, of lanes and numbers, which are repeated.

    The width is that of the lanes among them, unless it is given.
    """
    if width is None:
        width = next(kind.width for kind in kinds if kind != types.float64)
    return [
        repeated(builder, value, width) if kind == types.float64 else value
        for kind, value in zip(kinds, values, strict=True)
    ]


def lower_of(generate: Callable[..., Any]) -> Callable[..., Any]:
    """Return numba's function that generates code; ``generate`` takes a builder and vectors."""

    def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return generate(builder, *vectors_of(builder, signature.args, arguments))

    return lower


def lower_of_numbers(generate: Callable[..., Any]) -> Callable[..., Any]:
    """Return numba's function that generates code for single numbers."""

    def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return generate(builder, *arguments)

    return lower


def _let(operation: Any, generate: Callable[..., Any], *kinds: Any) -> None:
    lower_builtin(operation, *kinds)(lower_of(generate))


def _of_two_numbers(operation: Any, generate: Callable[..., Any], *, is_choice: bool) -> None:
    """Let an operator take lanes of one width, or lanes and a number."""

    @type_callable(operation)
    def typer_of(context: Any) -> Any:
        def typer(a: Any, b: Any) -> Any:
            kind = are_numbers(a, b)
            return LaneChoices(kind.width) if kind and is_choice else kind

        return typer

    _let(operation, generate, LaneNumbers, LaneNumbers)
    _let(operation, generate, LaneNumbers, types.float64)
    _let(operation, generate, types.float64, LaneNumbers)


def _of_two_choices(operation: Any, generate: Callable[..., Any]) -> None:
    @type_callable(operation)
    def typer_of(context: Any) -> Any:
        return lambda a, b: a if a == b and isinstance(a, LaneChoices) else None

    _let(operation, generate, LaneChoices, LaneChoices)


def _of_one(operation: Any, generate: Callable[..., Any], kind: Any) -> None:
    @type_callable(operation)
    def typer_of(context: Any) -> Any:
        return lambda a: a if isinstance(a, kind) else None

    _let(operation, generate, kind)


for _operation, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _of_two_numbers(
        _operation, lambda b, x, y, name=_name: getattr(b, name)(x, y), is_choice=False
    )
for _operation, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    _of_two_numbers(
        _operation, lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y), is_choice=True
    )
_of_two_numbers(operator.ne, lambda b, x, y: b.fcmp_unordered("!=", x, y), is_choice=True)
_of_two_choices(operator.and_, lambda b, x, y: b.and_(x, y))
_of_two_choices(operator.or_, lambda b, x, y: b.or_(x, y))
_of_one(operator.invert, lambda b, x: b.not_(x), LaneChoices)
_of_one(operator.neg, lambda b, x: b.fneg(x), LaneNumbers)


@type_callable(operator.getitem)
def _typer_of_element(context: Any) -> Any:
    def typer(lanes: Any, place: Any) -> Any:
        is_right = isinstance(lanes, LaneNumbers) and isinstance(place, types.Integer)
        return types.float64 if is_right else None

    return typer


@lower_builtin(operator.getitem, LaneNumbers, types.Integer)
def _element(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.extract_element(*arguments)
