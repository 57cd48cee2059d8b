"""The door for kinds of messages that somebody else named: only installed packages are imported.

A name comes from the ROS graph or from a recording. Importing is running code, so no package is
imported that the ament index does not have, nor one that just lies in the working folder.
"""

from __future__ import annotations

import importlib
import importlib.util
from pathlib import Path
import re
from typing import Any

from ament_index_python.packages import get_package_prefix

from scene_graph_ros.geometry.quoting import quoted

__all__ = ["UnknownKindError", "class_of_kind"]

_KIND = re.compile(r"([A-Za-z]\w*)/msg/([A-Za-z]\w*)", re.ASCII)


class UnknownKindError(ValueError):
    """A kind of messages that is not installed here, or no such name."""


def class_of_kind(kind: str) -> Any:
    """Return the class of ``package/msg/Name``. Raises UnknownKindError."""
    named = _KIND.fullmatch(kind)
    if named is None:
        raise UnknownKindError(f"{quoted(kind)} is no kind of messages: package/msg/Name")
    package, name = named.groups()
    try:
        get_package_prefix(package)
    except LookupError:
        raise UnknownKindError(f"{kind}: no package {package} is installed; install it") from None
    spec = importlib.util.find_spec(package)
    folders = () if spec is None else spec.submodule_search_locations or ()
    if any(Path(folder).resolve().parent == Path.cwd() for folder in folders):
        raise UnknownKindError(
            f"{kind}: {package} lies in the working folder, from which nothing is imported; start"
            " it from another folder"
        )
    try:
        return getattr(importlib.import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError) as error:
        raise UnknownKindError(f"{kind} is not in the installed {package}: {error}") from error
