"""Messages of packages that have no wheel: installed, or from the test workspace."""

from __future__ import annotations

import ctypes
import importlib
import importlib.machinery
from pathlib import Path
import sys
from typing import Any

import pytest

__all__ = ["WORKSPACE_VARIABLES", "message_class"]

_PREFIX = Path(sys.prefix) / "test_workspace"
_VERSION = f"python{sys.version_info[0]}.{sys.version_info[1]}"
_SITE_PACKAGES = _PREFIX / "lib" / _VERSION / "site-packages"

WORKSPACE_VARIABLES = {
    "PYTHONPATH": str(_SITE_PACKAGES),
    "LD_LIBRARY_PATH": str(_PREFIX / "lib"),
    "AMENT_PREFIX_PATH": str(_PREFIX),
}
"""What a process needs in its environment to find these messages."""


class _Asked:
    """Finds the packages of the test workspace that a test asks for, and no others.

    The product would find another one without its libraries.
    """

    packages: set[str] = set()  # noqa: RUF012 - of the process

    @classmethod
    def find_spec(cls, name: str, path: Any = None, target: Any = None) -> Any:
        """Return where a package is; its modules are found by its own path."""
        if path is None and name in cls.packages:
            return importlib.machinery.PathFinder.find_spec(name, [str(_SITE_PACKAGES)])
        return None


def message_class(package: str, name: str) -> Any:
    """Return the class of a message; skip where it is in neither place."""
    if importlib.machinery.PathFinder.find_spec(package) is None:
        if not (_SITE_PACKAGES / package).is_dir():
            pytest.skip(f"{package} is neither installed nor in the test workspace (`make test`)")
        if _Asked not in sys.meta_path:
            sys.meta_path.append(_Asked)
        _Asked.packages.add(package)
        _preload(sorted((_PREFIX / "lib").glob(f"lib{package}__*.so")))
    return getattr(importlib.import_module(f"{package}.msg"), name)


def _preload(libraries: list[Path]) -> None:
    """Load libraries that need each other, as their folder is not on this process's path."""
    for _ in range(len(libraries)):
        for library in libraries:
            try:
                ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
            except OSError:
                continue
