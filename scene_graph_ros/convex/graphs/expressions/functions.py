"""Costs and constraints that are functions of points, and need not be convex."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_vector
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array

__all__ = [
    "FunctionConstraint",
    "FunctionCost",
    "FunctionTerm",
    "PointProduct",
    "WrittenConstraint",
]


@dataclass(frozen=True, eq=False)
class FunctionCost:
    """The cost of a function of the points of an edge, ``xu`` and ``xv``, or of a vertex."""

    function: Callable[..., float]

    def at(self, points: Mapping[int, np.ndarray], numbers: Sequence[int]) -> float:
        """Return the cost at points ``(n,)`` by numbers of vertices, ``numbers`` being its own.

        Raises ConvexSetError unless it is a finite number.
        """
        return float(_values(self.function, points, numbers, 1)[0])


def _as_bounds(value: Any, label: str) -> np.ndarray:
    """Return a number, or numbers, as an array ``(k,)``; they may be infinite."""
    return np.atleast_1d(
        real_array(value, f"{label} must be a number or numbers (k,)", ConvexSetError)
    )


@one_line()
class FunctionConstraint:
    """``lower_bound <= function(points) <= upper_bound``, entry by entry.

    ``FunctionConstraint(function, lower_bound, upper_bound)``: the function takes the points
    ``(n,)`` of an edge, ``xu`` and ``xv``, or that of a vertex, and returns a number or ``(k,)``.
    Bounds are numbers or ``(k,)``, and may be infinite; equal ones make an equation.
    """

    def __init__(self, function: Callable[..., Any], lower_bound: Any, upper_bound: Any) -> None:
        if not callable(function):
            raise ConvexSetError(
                f"FunctionConstraint: function must be callable, not {quoted(function)}"
            )
        self.function = function
        self.lower, self.upper = (
            _as_bounds(each, f"FunctionConstraint: {name}")
            for name, each in (("lower_bound", lower_bound), ("upper_bound", upper_bound))
        )
        if self.lower.shape != self.upper.shape or self.lower.ndim != 1:
            raise ConvexSetError(
                f"FunctionConstraint: bounds have the shapes {self.lower.shape} and"
                f" {self.upper.shape}"
            )
        if np.isnan(self.lower).any() or not (self.lower <= self.upper).all():
            raise ConvexSetError(
                f"FunctionConstraint: lower_bound {self.lower.tolist()} must be at most"
                f" upper_bound {self.upper.tolist()}"
            )

    def at(self, points: Mapping[int, np.ndarray], numbers: Sequence[int]) -> np.ndarray:
        """Return by how much finite bounds are kept, ``(m,)``: negative where one is broken."""
        values = _values(self.function, points, numbers, len(self.lower))
        kept = [values - self.lower, self.upper - values]
        return np.concatenate(kept)[np.isfinite(np.concatenate([self.lower, self.upper]))]


@dataclass(frozen=True, eq=False)
class PointProduct:
    """``(rows @ x + constant) * y[-1] ** power`` ``(k,)``, x and y being a function's points.

    ``of`` and ``base`` say which of its points they are: 0 is the first one.
    """

    rows: np.ndarray
    constant: np.ndarray
    of: int
    base: int
    power: int


class WrittenConstraint(FunctionConstraint):
    """A constraint whose function is written with operators: also of expressions ``(n, 1)``.

    That is 0 or at least 0 in all entries, where the sum of two ``products`` is.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        products: tuple[PointProduct, PointProduct],
        *,
        is_equal: bool,
    ) -> None:
        zero = np.zeros(len(products[0].constant))
        super().__init__(function, zero, zero if is_equal else np.full(len(zero), np.inf))
        self.products, self.is_equal = products, is_equal


FunctionTerm = FunctionCost | FunctionConstraint


def _values(
    function: Callable[..., Any],
    points: Mapping[int, np.ndarray],
    numbers: Sequence[int],
    count: int,
) -> np.ndarray:
    value = function(*(points[number].copy() for number in numbers))
    found = as_vector(np.atleast_1d(value), f"what {quoted(function)} returns")
    if len(found) != count:
        raise ConvexSetError(
            f"what {quoted(function)} returns must have {count} entries, not {len(found)}"
        )
    return found
