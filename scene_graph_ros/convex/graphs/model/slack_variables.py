"""Slack variables of a vertex or an edge, in whose costs and constraints they may be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import Affine
from scene_graph_ros.convex.questions.arguments import as_whole
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array

__all__ = ["SlackVariables", "box_of"]

_MOST_ROWS = 10_000
"""Of one call: their expression has a square matrix."""


@dataclass(frozen=True, eq=False)
class SlackVariables:
    """Slack variables ``(k,)`` that were made by one call, and their bounds ``(k,)``.

    ``number`` is theirs in expressions, as those of vertices are.
    """

    number: int
    name: str
    lower: np.ndarray
    upper: np.ndarray

    def __len__(self) -> int:
        return len(self.lower)

    @classmethod
    def make(
        cls, label: str, number: int, rows: Any, name: str, lower: Any, upper: Any
    ) -> SlackVariables:
        """Return ``rows`` variables. Raises ConvexSetError for counts and bounds that are none."""
        count = as_whole(rows, f"{label}: rows", 1, _MOST_ROWS)
        bounds = [
            _as_bounds(each, count, f"{label}: {of}")
            for of, each in (("lower_bound", lower), ("upper_bound", upper))
        ]
        if not ((bounds[0] <= bounds[1]) & (bounds[0] < np.inf) & (bounds[1] > -np.inf)).all():
            raise ConvexSetError(
                f"{label}: lower_bound {bounds[0].tolist()} must be at most upper_bound"
                f" {bounds[1].tolist()}"
            )
        return cls(number, name, *bounds)

    @property
    def expression(self) -> Affine:
        """The variables as an expression of ``k`` entries."""
        return Affine({self.number: np.eye(len(self))}, np.zeros(len(self)))


def _as_bounds(value: Any, rows: int, label: str) -> np.ndarray:
    wanted = f"{label} must be a number or {rows} numbers"
    found = real_array(value, wanted, ConvexSetError)
    if found.shape not in ((), (rows,)) or np.isnan(found).any():
        raise ConvexSetError(f"{wanted}, not {quoted(value)}")
    return np.broadcast_to(found, (rows,))


def box_of(some: list[SlackVariables]) -> ConvexSet:
    """Return the set of values of slack variables behind one another."""
    lower, upper = (
        np.concatenate([getattr(each, name) for each in some]) for name in ("lower", "upper")
    )
    low, high = np.isfinite(lower), np.isfinite(upper)
    if low.all() and high.all():
        return Hyperrectangle(lower, upper)
    axes = np.eye(len(lower))
    return HPolyhedron(
        np.concatenate([-axes[low], axes[high]]), np.concatenate([-lower[low], upper[high]])
    )
