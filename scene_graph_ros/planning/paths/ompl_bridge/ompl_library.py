"""OMPL, imported when first asked for."""

from __future__ import annotations

from functools import cache
import importlib
import sys
from typing import Any, NamedTuple

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.missing_package import not_installed

__all__ = ["MissingOmplError", "OmplLibrary", "get_ompl"]


class MissingOmplError(SceneGraphError, ImportError):
    """OMPL is needed, and not installed."""


class OmplLibrary(NamedTuple):
    """Its modules."""

    base: Any
    geometric: Any
    util: Any


@cache
def get_ompl() -> OmplLibrary:
    """Return OMPL's modules. Raises MissingOmplError naming the remedy.

    A program that has imported OMPL before decides on its log; else only warnings are logged.
    """
    is_new = "ompl" not in sys.modules
    names = (f"ompl.{name}" for name in OmplLibrary._fields)
    try:
        found = OmplLibrary(*(importlib.import_module(name) for name in names))
    except ImportError as error:
        raise MissingOmplError(not_installed("a planner of OMPL", "ompl")) from error
    if is_new:
        found.util.setLogLevel(found.util.LOG_WARN)
    return found
