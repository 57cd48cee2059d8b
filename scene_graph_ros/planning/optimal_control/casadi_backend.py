"""CasADi, imported when first asked for."""

from __future__ import annotations

import importlib
from typing import Any

from scene_graph_ros.missing_package import not_installed
from scene_graph_ros.planning.optimal_control.errors import MissingCasadiError

__all__ = ["get_casadi"]


def get_casadi() -> Any:
    """Return the module. Raises MissingCasadiError naming the remedy."""
    try:
        return importlib.import_module("casadi")
    except ImportError as error:
        raise MissingCasadiError(not_installed("trajectory optimization", "casadi")) from error
