"""TOPP-RA and Ruckig, imported when first asked for."""

from __future__ import annotations

from functools import cache
import importlib
from typing import Any, NamedTuple

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.missing_package import not_installed

__all__ = ["MissingRetimerError", "ToppraLibrary", "get_ruckig", "get_toppra"]


class MissingRetimerError(SceneGraphError, ImportError):
    """A retimer is asked for that is not installed."""


class ToppraLibrary(NamedTuple):
    """Its modules."""

    algorithm: Any
    constraint: Any
    interpolator: Any


@cache
def get_toppra() -> ToppraLibrary:
    """Return TOPP-RA's modules. Raises MissingRetimerError naming the remedy."""
    try:
        return ToppraLibrary(
            *(importlib.import_module(f"toppra.{name}") for name in ToppraLibrary._fields)
        )
    except ImportError as error:
        raise MissingRetimerError(not_installed("the retimer 'toppra'", "toppra")) from error


@cache
def get_ruckig() -> Any:
    """Return Ruckig's module. Raises MissingRetimerError naming the remedy."""
    try:
        return importlib.import_module("ruckig")
    except ImportError as error:
        raise MissingRetimerError(not_installed("the retimer 'ruckig'", "ruckig")) from error
