"""The two settings of pairwise queries: the accuracy of answers, and the engine."""

from __future__ import annotations

import enum
import importlib.util
from typing import Any, TypeVar

from scene_graph_ros.geometry.errors import EngineError, QueryArgumentError
from scene_graph_ros.missing_package import not_installed

__all__ = ["BOUNDS", "Accuracy", "Engine", "as_accuracy", "as_engine"]

Choice = TypeVar("Choice", bound=enum.StrEnum)


class Accuracy(enum.StrEnum):
    """A tier of accuracy. Each is a string, so that ``"quick"`` may be written for ``QUICK``."""

    QUICK = "quick"
    STANDARD = "standard"
    EXACT = "exact"

    @property
    def bound(self) -> float:
        """The largest error of a distance, relative to the size of the pair's larger shape."""
        return BOUNDS[self]


BOUNDS = {Accuracy.QUICK: 1e-3, Accuracy.STANDARD: 1e-6, Accuracy.EXACT: 1e-12}
"""What each tier promises, the only place that says it: 0.2 mm, 0.2 um and rounding for shapes of
20 cm. Pairs with a closed form are exact at every tier."""


class Engine(enum.StrEnum):
    """The engine that computes a pair's distance: our kernels, or FCL for comparison."""

    NATIVE = "native"
    FCL = "fcl"


def _as_choice(kind: type[Choice], name: str, value: Any) -> Choice:
    try:
        return kind(value)
    except ValueError:
        choices = ", ".join(repr(choice.value) for choice in kind)
        raise QueryArgumentError(f"{name} must be one of {choices}, not {value!r}") from None


def as_accuracy(value: Any) -> Accuracy:
    """Return the tier of that name. Raises QueryArgumentError."""
    return _as_choice(Accuracy, "accuracy", value)


def as_engine(value: Any) -> Engine:
    """Return the engine of that name, without loading it.

    Raises QueryArgumentError for another name, EngineError for one that is not installed.
    """
    engine = _as_choice(Engine, "engine", value)
    if engine is Engine.FCL and importlib.util.find_spec("fcl") is None:
        raise EngineError(not_installed("engine 'fcl'", "python-fcl"))
    return engine
