"""Values derived from other values: computed when first asked for, and kept while they hold.

A function that derives something says beside its definition what that depends on. It is called
like any function; whoever changes a model says which parts of it have changed, and what depends
on none of them is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
import enum
import functools
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


class _Slot:
    """The place of one function's values. It says what they depend on.

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


_computing: dict[int, list[_Slot]] = {}
"""What each thread that computes a value is about, the innermost last."""


def _check_dependence(slot: _Slot) -> None:
    """Assert that what this thread computes just now may read the values of a slot."""
    reading = _computing.get(threading.get_ident())
    if reading:
        outer = reading[-1]
        assert slot.parts <= outer.parts, (
            f"{outer.function.__name__} reads {slot.function.__name__}, which depends on"
            f" {sorted(str(part) for part in slot.parts - outer.parts)}, too"
        )


class DerivedValues:
    """What was derived of one owner, by slot and further arguments. Any thread may ask."""

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
        if _computing:
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

    def forget(self, changed: Iterable[Part | Role]) -> None:
        """Forget what depends on what has changed; one thread at a time."""
        parts = frozenset(changed)
        for key in [key for key in self._values if not parts.isdisjoint(key[0].parts)]:
            value = self._values.pop(key)
            if key[0].is_renewed:
                self._before[key] = value


def _computed(slot: _Slot, arguments: tuple[Any, ...]) -> Any:
    thread = threading.get_ident()
    _computing.setdefault(thread, []).append(slot)
    try:
        return slot.function(*arguments)
    finally:
        _computing[thread].pop()
        if not _computing[thread]:
            del _computing[thread]


class _Model(Protocol):
    """What changes, and says so."""

    @property
    def derived(self) -> DerivedValues: ...


class _Constant(Protocol):
    """What never changes."""

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
    """Do what ``derived`` does for a function that makes its value out of the one before.

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
