"""The choice of a solver of cone programs, with settings of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import importlib.util
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.missing_package import not_installed

__all__ = ["CONTINUOUS", "MIXED_INTEGER", "SolverChoice", "as_choice", "check_names"]

CONTINUOUS = {
    "clarabel": "clarabel",
    "highs": "scipy",
    "scs": "scs",
}
"""Solvers of programs without whole numbers, and the packages that they come with."""

MIXED_INTEGER = {"scip": "pyscipopt"}
"""Solvers of programs with whole numbers."""


@dataclass(frozen=True)
class SolverChoice:
    """A solver by its name, and the values of its own settings."""

    name: str = "clarabel"
    options: Mapping[str, Any] = field(default_factory=dict)


def as_choice(
    name: Any, options: Any, label: str, known: Mapping[str, str] | None = None
) -> SolverChoice | None:
    """Return a choice; None where neither is given. Options alone are those of Clarabel.

    Raises ConvexSetError for a name that is not among the known, which it lists, for one whose
    package is not installed, and for options that are no mapping of names.
    """
    known = CONTINUOUS if known is None else known
    if name is None and options is None:
        return None
    if name is None:
        name = "clarabel"
    if not isinstance(name, str) or name not in known:
        raise ConvexSetError(
            f"{label} must be one of {', '.join(map(repr, known))}, not {quoted(name)}"
        )
    if importlib.util.find_spec(known[name]) is None:
        raise ConvexSetError(not_installed(f"{label}: {name!r}", known[name]))
    settings = {} if options is None else options
    if not isinstance(settings, Mapping) or not all(isinstance(key, str) for key in settings):
        raise ConvexSetError(
            f"{label}: its options must be a mapping of their names to values, not"
            f" {quoted(options)}"
        )
    return SolverChoice(name, dict(settings))


def check_names(options: Mapping[str, Any], known: Any, label: str) -> None:
    """Raise ConvexSetError where an option has a name that a solver does not know."""
    unknown = next((name for name in options if name not in known), None)
    if unknown is not None:
        raise ConvexSetError(
            f"{label} has no option {unknown!r}; it has {', '.join(sorted(known))}"
        )
