"""Classes of messages whose packages may not be installed."""

from __future__ import annotations

import importlib
from typing import Any

from msg_adapters.errors import UnavailableError

__all__ = ["imported_type"]


def imported_type(name: str) -> Any:
    """Import the class of ``package/msg/Name``, one of those that the node reads.

    Raises UnavailableError where its package is not installed.
    """
    package, _, kind = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), kind)
    except ModuleNotFoundError as error:
        raise UnavailableError(f"{package} is not installed, so no {name} can be read") from error
