"""Code that is written by functions, for kernels in which the compiler finds no vectors itself.

Such a function is called once, when a kernel that uses it is compiled; its arguments stand for
those of the kernel's call, and what it does with them becomes the kernel's code, in the same
order. Numbers in step are vectors: an operation is done for all of them by one instruction.
Arithmetic is IEEE's, without fusion.

Where nothing is compiled (``NUMBA_DISABLE_JIT=1``), a plain function takes its place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
import inspect
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
import numba.core.config as numba_config
from numba.extending import intrinsic

__all__ = [
    "ARRAY",
    "ARRAYS",
    "NUMBER",
    "PLACE",
    "YES_OR_NO",
    "Array",
    "Code",
    "Kept",
    "Value",
    "generated",
    "repeated",
]

ARRAY = "array"
"""A C-contiguous array, seen as flat."""
ARRAYS = "arrays"
"""A tuple of such arrays."""
PLACE = "place"
"""An integer."""
NUMBER = "number"
"""A float64."""
YES_OR_NO = "yes or no"
"""A boolean; only returned."""

_DOUBLE = ir.DoubleType()
_WORD = ir.IntType(64)
_BYTE = ir.IntType(8)
_INDEX = ir.IntType(32)
_LINE_BYTES = 64
_TYPES = {PLACE: types.intp, NUMBER: types.float64, YES_OR_NO: types.boolean, None: types.void}


def repeated(builder: Any, number: Any, width: int) -> Any:
    """Return a vector, in LLVM's form, of one number."""
    undefined = ir.Constant(ir.VectorType(number.type, width), ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(_INDEX, 0))
    zeros = ir.Constant(ir.VectorType(_INDEX, width), [0] * width)
    return builder.shuffle_vector(one, one, zeros)


def _constant(kind: Any, number: float) -> Any:
    """Return a number of a type, or a vector of it."""
    return ir.Constant(kind, [number] * kind.count if isinstance(kind, ir.VectorType) else number)


class Value:
    """A number, an integer or a choice that is known when the code runs, or a vector of them."""

    __slots__ = ("_builder", "ir")

    def __init__(self, builder: Any, value: Any) -> None:
        self._builder = builder
        self.ir = value

    def _is_real(self) -> bool:
        kind = self.ir.type
        return (kind.element if isinstance(kind, ir.VectorType) else kind) == _DOUBLE

    def _ir_of(self, other: Value | float) -> Any:
        return other.ir if isinstance(other, Value) else _constant(self.ir.type, other)

    def _do(self, of_reals: str, of_integers: str, other: Value | float) -> Value:
        name = of_reals if self._is_real() else of_integers
        return Value(self._builder, getattr(self._builder, name)(self.ir, self._ir_of(other)))

    def __add__(self, other: Value | float) -> Value:
        return self._do("fadd", "add", other)

    def __sub__(self, other: Value | float) -> Value:
        return self._do("fsub", "sub", other)

    def __mul__(self, other: Value | float) -> Value:
        return self._do("fmul", "mul", other)

    def __neg__(self) -> Value:
        return Value(self._builder, self._builder.fneg(self.ir))

    def __and__(self, other: Value | int) -> Value:
        return Value(self._builder, self._builder.and_(self.ir, self._ir_of(other)))

    def __or__(self, other: Value | int) -> Value:
        return Value(self._builder, self._builder.or_(self.ir, self._ir_of(other)))

    def __rshift__(self, bits: int) -> Value:
        return Value(self._builder, self._builder.lshr(self.ir, self._ir_of(bits)))

    def _compare(self, sign: str, other: Value | float) -> Value:
        compare = self._builder.fcmp_ordered if self._is_real() else self._builder.icmp_signed
        return Value(self._builder, compare(sign, self.ir, self._ir_of(other)))

    def __lt__(self, other: Value | float) -> Value:
        return self._compare("<", other)

    def __le__(self, other: Value | float) -> Value:
        return self._compare("<=", other)

    def __gt__(self, other: Value | float) -> Value:
        return self._compare(">", other)

    def __ge__(self, other: Value | float) -> Value:
        return self._compare(">=", other)

    def equals(self, other: Value | float) -> Value:
        """Return whether numbers are equal; nan is not."""
        return self._compare("==", other)

    def differs(self, other: Value | float) -> Value:
        """Return whether numbers are unequal; nan is."""
        other_ir = self._ir_of(other)
        return Value(self._builder, self._builder.fcmp_unordered("!=", self.ir, other_ir))

    def __getitem__(self, place: int) -> Value:
        """Return a number of a vector."""
        at = ir.Constant(_INDEX, place)
        return Value(self._builder, self._builder.extract_element(self.ir, at))

    # The operators above are no relations of objects.
    __hash__ = None  # type: ignore[assignment]


class Array:
    """A C-contiguous array, or the part of one from some place on, seen as flat."""

    __slots__ = ("_builder", "_data", "shape")

    def __init__(self, builder: Any, data: Any, shape: Sequence[Value] = ()) -> None:
        self._builder = builder
        self._data = data
        self.shape = shape

    def _pointer(self, at: Value | int, kind: Any = None) -> Any:
        place = at.ir if isinstance(at, Value) else ir.Constant(_WORD, at)
        pointer = self._builder.gep(self._data, [place])
        return pointer if kind is None else self._builder.bitcast(pointer, kind.as_pointer())

    def start(self, at: Value | int) -> Array:
        """Return the part of the array from a place on."""
        return Array(self._builder, self._pointer(at))

    def number(self, at: Value | int) -> Value:
        """Return the number at a place."""
        return Value(self._builder, self._builder.load(self._pointer(at)))

    def vector(self, at: Value | int, width: int) -> Value:
        """Return the ``width`` numbers from a place on."""
        kind = ir.VectorType(self._data.type.pointee, width)
        return Value(self._builder, self._builder.load(self._pointer(at, kind), align=8))

    def write(self, at: Value | int, vector: Value) -> None:
        """Write the numbers of a vector, from a place on."""
        pointer = self._pointer(at, vector.ir.type)
        self._builder.store(vector.ir, pointer, align=8)

    def write_bytes(self, at: Value | int, value: Value) -> None:
        """Write a word or a vector of bytes, from any byte on."""
        self._builder.store(value.ir, self._pointer(at, value.ir.type), align=1)

    def stream(self, at: Value | int, vector: Value) -> None:
        """Write a vector that is a line of the cache past the caches; see ``streams``."""
        pointer = self._pointer(at, vector.ir.type)
        written = self._builder.store(vector.ir, pointer, align=_LINE_BYTES)
        one = self._builder.module.add_metadata([ir.Constant(_INDEX, 1)])
        written.set_metadata("nontemporal", one)


class Kept:
    """A value that a loop changes."""

    __slots__ = ("_builder", "_place")

    def __init__(self, builder: Any, value: Value) -> None:
        self._builder = builder
        self._place = cgutils.alloca_once_value(builder, value.ir)

    def read(self) -> Value:
        """Return the value of now."""
        return Value(self._builder, self._builder.load(self._place))

    def write(self, value: Value) -> None:
        """Replace the value."""
        self._builder.store(value.ir, self._place)


class Code:
    """What can be written beside operations of values."""

    __slots__ = ("_builder",)

    def __init__(self, builder: Any) -> None:
        self._builder = builder

    def place(self, value: int) -> Value:
        """Return an integer."""
        return Value(self._builder, ir.Constant(_WORD, value))

    def numbers(self, *values: float) -> Value:
        """Return a vector of numbers."""
        vector = ir.Constant(ir.VectorType(_DOUBLE, len(values)), list(values))
        return Value(self._builder, vector)

    def places(self, *values: int) -> Value:
        """Return a vector of integers."""
        vector = ir.Constant(ir.VectorType(_WORD, len(values)), list(values))
        return Value(self._builder, vector)

    def repeated(self, value: Value, width: int) -> Value:
        """Return a vector of one number."""
        return Value(self._builder, repeated(self._builder, value.ir, width))

    def real(self, place: Value) -> Value:
        """Return an integer as a number."""
        return Value(self._builder, self._builder.sitofp(place.ir, _DOUBLE))

    def merged(self, first: Value, second: Value, places: Sequence[int]) -> Value:
        """Return numbers of two vectors; places of the second's count on from the first's end."""
        mask = ir.Constant(ir.VectorType(_INDEX, len(places)), list(places))
        return Value(self._builder, self._builder.shuffle_vector(first.ir, second.ir, mask))

    def reordered(self, vector: Value, places: Sequence[int]) -> Value:
        """Return the numbers of a vector in another order."""
        return self.merged(vector, vector, places)

    def replaced(self, vector: Value, place: int, number: Value) -> Value:
        """Return a vector with another number at a place."""
        at = ir.Constant(_INDEX, place)
        return Value(self._builder, self._builder.insert_element(vector.ir, number.ir, at))

    def sum(self, values: Sequence[Value]) -> Value:
        """Return the sum, from the first on."""
        total = values[0]
        for value in values[1:]:
            total = total + value
        return total

    def dot(self, a: Sequence[Value], b: Sequence[Value]) -> Value:
        """Return the sum of the products of coordinates, from the first on."""
        return self.sum([p * q for p, q in zip(a, b, strict=True)])

    def select(self, choice: Value, a: Value, b: Value) -> Value:
        """Return a where a choice is true, else b."""
        return Value(self._builder, self._builder.select(choice.ir, a.ir, b.ir))

    def smaller(self, a: Value, b: Value) -> Value:
        """Return the smaller of the numbers at the same places; b where one is nan."""
        return self.select(a < b, a, b)

    def larger(self, a: Value, b: Value) -> Value:
        """Return the larger of the numbers at the same places; b where one is nan."""
        return self.select(a > b, a, b)

    def magnitude(self, vector: Value) -> Value:
        """Return the numbers without their signs."""
        return self._call("fabs", vector)

    def square_root(self, vector: Value) -> Value:
        """Return the square roots."""
        return self._call("sqrt", vector)

    def _call(self, name: str, vector: Value) -> Value:
        kind = vector.ir.type
        function = self._builder.module.declare_intrinsic(
            f"llvm.{name}.v{kind.count}f64", fnty=ir.FunctionType(kind, [kind])
        )
        return Value(self._builder, self._builder.call(function, [vector.ir]))

    def _bits(self, choices: Value) -> Any:
        kind = ir.IntType(choices.ir.type.count)
        return kind, self._builder.bitcast(choices.ir, kind)

    def all_of(self, choices: Value) -> Value:
        """Return whether all choices of a vector are true."""
        kind, bits = self._bits(choices)
        full = ir.Constant(kind, 2**kind.width - 1)
        return Value(self._builder, self._builder.icmp_unsigned("==", bits, full))

    def any_of(self, choices: Value) -> Value:
        """Return whether one of the choices of a vector is true."""
        kind, bits = self._bits(choices)
        return Value(self._builder, self._builder.icmp_unsigned("!=", bits, ir.Constant(kind, 0)))

    def as_bytes(self, choices: Value) -> Value:
        """Return a vector of bytes that are 1 where a choice is true, else 0."""
        kind = ir.VectorType(_BYTE, choices.ir.type.count)
        return Value(self._builder, self._builder.zext(choices.ir, kind))

    def kept(self, value: Value) -> Kept:
        """Return a place for a value that a loop changes."""
        return Kept(self._builder, value)

    @contextlib.contextmanager
    def loop(self, count: Value, start: int = 0) -> Iterator[Value]:
        """Write code that runs for each integer from ``start`` to below ``count``."""
        first = None if start == 0 else ir.Constant(_WORD, start)
        with cgutils.for_range(self._builder, count.ir, start=first) as loop:
            yield Value(self._builder, loop.index)

    def if_likely(self, choice: Value) -> Any:
        """Return the two blocks of code for a choice that is mostly true, and else."""
        return self._builder.if_else(choice.ir, likely=True)


def _argument(context: Any, builder: Any, kind: str, of_numba: Any, value: Any) -> Any:
    if kind == ARRAY:
        array = context.make_array(of_numba)(context, builder, value)
        shape = [Value(builder, size) for size in cgutils.unpack_tuple(builder, array.shape)]
        return Array(builder, array.data, shape)
    if kind == ARRAYS:
        parts = zip(of_numba, cgutils.unpack_tuple(builder, value), strict=True)
        return [_argument(context, builder, ARRAY, part, array) for part, array in parts]
    return Value(builder, value)


def _are_contiguous(kind: str, of_numba: Any) -> bool:
    arrays = of_numba if kind == ARRAYS else [of_numba] if kind == ARRAY else []
    return all(isinstance(array, types.Array) and array.layout == "C" for array in arrays)


def generated(
    *kinds: str, plain: Callable[..., Any], returns: str | None = None
) -> Callable[[Callable[..., Value | None]], Any]:
    """Let kernels call a function that writes code, with arguments of these kinds.

    The function gets a ``Code`` and its arguments: ``Array`` for ARRAY, a list of them for
    ARRAYS, ``Value`` for PLACE and NUMBER. It returns the Value that the call gives, of the kind
    ``returns``, or None. ``plain`` does the same where nothing is compiled.
    """

    def decorate(write: Callable[..., Value | None]) -> Any:
        if numba_config.DISABLE_JIT:
            return plain

        def typed(typing_context: Any, *given: Any) -> Any:
            if len(given) != len(kinds) or not all(map(_are_contiguous, kinds, given)):
                return None
            pairs = zip(kinds, given, strict=True)
            taken = [_TYPES.get(kind, of_numba) for kind, of_numba in pairs]

            def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                result = write(
                    Code(builder),
                    *[
                        _argument(context, builder, *one)
                        for one in zip(kinds, signature.args, arguments, strict=True)
                    ],
                )
                return context.get_dummy_value() if result is None else result.ir

            return _TYPES[returns](*taken), lower

        typed.__name__, typed.__doc__ = write.__name__, write.__doc__
        # Numba looks at names of parameters. The first stands for its own context.
        typed.__signature__ = inspect.signature(write)  # type: ignore[attr-defined]
        return intrinsic(typed)

    return decorate
