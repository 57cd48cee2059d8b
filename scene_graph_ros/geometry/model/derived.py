"""Values derived from other values: computed when first asked for, and kept while they hold.

A function that derives something declares its dependences beside its definition. It is called
like any function; a change of a model names its changed parts, and values that depend
on none of them are kept: the changed model gets those values in the write that changes it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
import enum
import functools
import sys
import threading
from typing import Any, Protocol, TypeVar, TypeVarTuple

from scene_graph_ros.geometry.model.roles import Role

__all__ = ["DerivedValues", "Part", "derived", "derived_of_constant", "renewed"]


class Part(enum.Enum):
    """Parts of a model, beside the geometries with a role, that something can depend on."""

    FRAMES = "frames"
    """Sources and frames: what there is, in which order, with which names and parents."""
    FILTERS = "filters"
    """Declarations that exclude pairs from collision."""

    __hash__ = object.__hash__  # as Role's


class _Slot:
    """The place of one function's values. It has their dependences.

    A function may read other derived values, but none that depends on more than it says itself:
    its own would go stale with them.
    """

    __slots__ = ("function", "is_renewed", "parts")

    def __init__(
        self, function: Callable[..., Any], parts: Iterable[Part | Role], *, is_renewed: bool
    ) -> None:
        self.function = function
        self.parts = frozenset(parts)
        self.is_renewed = is_renewed


_computing: set[int] = set()
"""Threads that compute a value; also one that was interrupted, until it asks again."""


def _check_dependence(slot: _Slot) -> None:
    """Assert that this thread's present computation may read the values of a slot."""
    frame = sys._getframe()
    while frame.f_code is not _computed.__code__:
        if frame.f_back is None:
            _computing.discard(threading.get_ident())
            return
        frame = frame.f_back
    outer = frame.f_locals["slot"]
    assert slot.parts <= outer.parts, (
        f"{outer.function.__name__} reads {slot.function.__name__}, which depends on"
        f" {sorted(str(part) for part in slot.parts - outer.parts)}, too"
    )


class DerivedValues:
    """The derived values of one owner, by slot and further arguments. Any thread may ask."""

    __slots__ = ("_before", "_lock", "_values")

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._values: dict[tuple[_Slot, tuple[Hashable, ...]], Any] = {}
        self._before: dict[tuple[_Slot, tuple[Hashable, ...]], Any] = {}

    def copy(self) -> DerivedValues:
        """Return values of a copy of the owner; each forgets its own."""
        result = DerivedValues()
        with self._lock:
            result._values, result._before = dict(self._values), dict(self._before)
        return result

    def of(self, slot: _Slot, owner: Any, arguments: tuple[Hashable, ...]) -> Any:
        """Return a value, computed once; other threads wait for it."""
        if _computing and threading.get_ident() in _computing:
            _check_dependence(slot)
        key = (slot, arguments)
        try:
            return self._values[key]
        except KeyError:
            pass
        with self._lock:
            if key not in self._values:
                before = (self._before.pop(key, None),) if slot.is_renewed else ()
                self._values[key] = _computed(slot, (owner, *arguments, *before))
            return self._values[key]

    def without(self, changed: Iterable[Part | Role]) -> DerivedValues:
        """Return the values that do not depend on changed parts: all of them where none do.

        These stay as they are.
        """
        if not self._values:
            return self
        parts = frozenset(changed)
        with self._lock:
            gone = [key for key in self._values if not parts.isdisjoint(key[0].parts)]
            if not gone:
                return self
            result = self.copy()
        for key in gone:
            value = result._values.pop(key)
            if key[0].is_renewed:
                result._before[key] = value
        return result


def _computed(slot: _Slot, arguments: tuple[Any, ...]) -> Any:
    thread = threading.get_ident()
    is_outermost = thread not in _computing
    try:
        _computing.add(thread)
        return slot.function(*arguments)
    finally:
        if is_outermost:
            _computing.discard(thread)


class _Model(Protocol):
    """An owner that changes, and says so."""

    @property
    def derived(self) -> DerivedValues: ...


class _Constant(Protocol):
    """An owner that never changes."""

    @property
    def derived_for_good(self) -> DerivedValues: ...


M = TypeVar("M", bound=_Model)
C = TypeVar("C", bound=_Constant)
Value = TypeVar("Value")
Arguments = TypeVarTuple("Arguments")


def derived(
    part: Part | Role, *parts: Part | Role
) -> Callable[[Callable[[M, *Arguments], Value]], Callable[[M, *Arguments], Value]]:
    """Let a function of a model, and of hashable arguments, compute each value once.

    The value is forgotten when one of the parts changes: name all that the function reads.
    """

    def decorate(function: Callable[[M, *Arguments], Value]) -> Callable[[M, *Arguments], Value]:
        slot = _Slot(function, (part, *parts), is_renewed=False)

        @functools.wraps(function)
        def ask(model: M, *arguments: *Arguments) -> Value:
            result: Value = model.derived.of(slot, model, arguments)
            return result

        return ask

    return decorate


def renewed(
    part: Part | Role, *parts: Part | Role
) -> Callable[[Callable[[M, Value | None], Value]], Callable[[M], Value]]:
    """Do the same as ``derived`` for a function that makes its value out of the one before.

    It gets the value that was forgotten last, once, or None.
    """

    def decorate(function: Callable[[M, Value | None], Value]) -> Callable[[M], Value]:
        slot = _Slot(function, (part, *parts), is_renewed=True)

        @functools.wraps(function)
        def ask(model: M) -> Value:
            result: Value = model.derived.of(slot, model, ())
            return result

        return ask

    return decorate


def derived_of_constant(
    function: Callable[[C, *Arguments], Value],
) -> Callable[[C, *Arguments], Value]:
    """Let a function of something that never changes compute each value once."""
    slot = _Slot(function, (), is_renewed=False)

    @functools.wraps(function)
    def ask(constant: C, *arguments: *Arguments) -> Value:
        result: Value = constant.derived_for_good.of(slot, constant, arguments)
        return result

    return ask
