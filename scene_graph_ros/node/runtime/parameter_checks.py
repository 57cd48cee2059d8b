"""Whether values of the node's parameters go together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scene_graph_ros.node.runtime.parameters import defaults, PARAMETERS
from scene_graph_ros.views.loopback import is_loopback
from scene_graph_ros.views.origins import origins_of

__all__ = ["validate"]

_BY_NAME = {parameter.name: parameter for parameter in PARAMETERS}


def validate(values: Mapping[str, Any], current: Mapping[str, Any] | None = None) -> list[str]:
    """List the faults of ``values`` set together on top of ``current``; empty if there is none.

    ``current`` holds the values of the other parameters, their defaults where it is None.
    Names that this table does not know are wrong, too.
    """
    problems = []
    for name, value in values.items():
        parameter = _BY_NAME.get(name)
        problem = f"unknown parameter {name}" if parameter is None else parameter.problem(value)
        if problem is not None:
            problems.append(problem)
    if problems:
        return problems
    merged = {**defaults(), **(current or {}), **values}
    if merged["min_update_rate"] > merged["max_update_rate"]:
        problems.append(
            f"min_update_rate {merged['min_update_rate']} must not be greater than "
            f"max_update_rate {merged['max_update_rate']}"
        )
    if not merged["browser_token"] and not is_loopback(merged["browser_host"]):
        problems.append(
            f"browser_host {merged['browser_host']!r} is reached from other machines: "
            "give a browser_token, too"
        )
    if merged["browser_control"] and not merged["browser_token"]:
        problems.append("browser_control lets pages move joints: give a browser_token, too")
    if merged["browser_execute"] and not merged["browser_control"]:
        problems.append("browser_execute lets pages move robots: set browser_control, too")
    try:
        origins_of(merged["browser_origins"])
    except ValueError as error:
        problems.append(f"browser_origins: {error}")
    return problems
