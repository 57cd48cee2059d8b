"""Messages of TF, whose package has no wheel: installed, or from the test workspace."""

from __future__ import annotations

import ctypes
import importlib.util
from pathlib import Path
import sys
from typing import Any

import pytest

__all__ = ["TF_PREFIX", "TF_SITE_PACKAGES", "tf_message_class"]

TF_PREFIX = Path(sys.prefix) / "test_workspace"
_VERSION = f"python{sys.version_info[0]}.{sys.version_info[1]}"
TF_SITE_PACKAGES = TF_PREFIX / "lib" / _VERSION / "site-packages"


def tf_message_class() -> Any:
    """Return the class TFMessage; skip where it is in neither place."""
    if importlib.util.find_spec("tf2_msgs") is None:
        if not TF_SITE_PACKAGES.is_dir():
            pytest.skip("tf2_msgs is neither installed nor in the test workspace (`make test`)")
        sys.path.append(str(TF_SITE_PACKAGES))
        _preload(sorted((TF_PREFIX / "lib").glob("libtf2_msgs__*.so")))
    return importlib.import_module("tf2_msgs.msg").TFMessage


def _preload(libraries: list[Path]) -> None:
    """Load libraries that need each other, as their folder is not on this process's path."""
    for _ in range(len(libraries)):
        for library in libraries:
            try:
                ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
            except OSError:
                continue
