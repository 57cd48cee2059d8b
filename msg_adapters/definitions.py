"""What messages are made of, as text, for programs that have not installed them."""

from __future__ import annotations

import importlib
from pathlib import Path
import re
from typing import Any

from ament_index_python.packages import get_package_share_directory

__all__ = ["definition_with_parts", "kind_of"]

_SEPARATOR = f"\n{'=' * 80}\nMSG: "
"""Between the definitions of a message and of its parts, as rosbag2 and MCAP have it."""

_NAMED = re.compile(r"(\w+)/(\w+)")


def kind_of(message_class: Any) -> str:
    """Return the name of a class of messages, ``package/msg/Name``."""
    package = message_class.__module__.split(".", 1)[0]
    return f"{package}/msg/{message_class.__name__}"


def definition_with_parts(kind: str) -> str:
    """Return the definition of ``package/msg/Name`` and, after it, those of all its parts.

    They are the files that packages install. Raises ImportError, LookupError or OSError where
    they are not.
    """
    parts = [kind]
    for part in parts:
        for field in _class(part).get_fields_and_field_types().values():
            named = _NAMED.search(field)
            name = f"{named[1]}/msg/{named[2]}" if named else ""
            if name and name not in parts:
                parts.append(name)
    others = [f"{part.replace('/msg/', '/')}\n{_text(part)}" for part in parts[1:]]
    return _SEPARATOR.join([_text(kind), *others])


def _class(kind: str) -> Any:
    package, _, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def _text(kind: str) -> str:
    package, _, name = kind.split("/")
    path = Path(get_package_share_directory(package)) / "msg" / f"{name}.msg"
    return path.read_text(encoding="utf8")
