"""Expressions of placeholders, with variables of knots or of places between for them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi

__all__ = ["at_place", "at_places"]


def at_place(expression: Any, symbols: Sequence[Any], values: Sequence[Any]) -> Any:
    """Return an expression with ``values`` for ``symbols``."""
    ca = get_casadi()
    given = [ca.MX(value) for value in values]
    return ca.substitute([ca.MX(expression)], list(symbols), given)[0]


def at_places(expression: Any, symbols: Sequence[Any], values: Sequence[Sequence[Any]]) -> Any:
    """Return a column at each of some places, as columns side by side.

    ``values`` has for each symbol one value a place. One function is made of the expression and
    mapped over them, which is sooner than putting values in for each place by itself.
    """
    ca = get_casadi()
    known = {symbol.__hash__() for symbol in symbols}
    if all(symbol.__hash__() in known for symbol in ca.symvar(expression)):
        function = ca.Function("at", list(symbols), [ca.densify(expression)])
        return function.map(len(values[0]))(*(ca.horzcat(*each) for each in values))
    places = zip(*values, strict=True)
    return ca.horzcat(*(at_place(expression, symbols, place) for place in places))
