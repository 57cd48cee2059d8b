"""Public names of a package, each imported when it is first used.

The package states where they are by imports for type checkers::

    if TYPE_CHECKING:
        from scene_graph_ros.robots.robot_model import RobotModel

    __all__ = ["RobotModel"]

    __getattr__, __dir__ = lazy_names(__name__)
"""

from __future__ import annotations

import ast
from collections.abc import Callable
import importlib
import sys
from typing import Any

__all__ = ["lazy_names"]


def lazy_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the ``__getattr__`` and ``__dir__`` of a package, to be called while it is imported.

    The modules are those of the imports in its source's ``if TYPE_CHECKING`` block.
    """
    module = sys.modules[package]
    module_of = _module_of(module.__loader__.get_source(package))  # type: ignore[union-attr]

    def get(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        try:
            found = importlib.import_module(module_of[name])
        except AttributeError as error:
            # As it is, it would be taken for a name that this package has not.
            raise ImportError(f"{module_of[name]} can't be imported: {error}") from error
        value = getattr(found, name)
        setattr(module, name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(module), *module_of})

    return get, names


def _module_of(source: str) -> dict[str, str]:
    """Return the modules of names that are imported for type checkers alone, at the top level."""
    return {
        alias.name: statement.module or ""
        for block in ast.parse(source).body
        if isinstance(block, ast.If)
        and isinstance(block.test, ast.Name)
        and block.test.id == "TYPE_CHECKING"
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }
