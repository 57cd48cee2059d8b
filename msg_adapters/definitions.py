"""Definitions of messages, as text, for programs that have not installed them."""

from __future__ import annotations

import functools
import hashlib
import json
from pathlib import Path
import re
from typing import Any

from ament_index_python.packages import get_package_share_directory

from msg_adapters.message_classes import class_of_kind

__all__ = ["definition_with_parts", "kind_of", "layout_of"]

_SEPARATOR = f"\n{'=' * 80}\nMSG: "
"""Between the definitions of a message and of its parts, as rosbag2 and MCAP have it."""

_NAMED = re.compile(r"(\w+)/(\w+)")


def kind_of(message_class: Any) -> str:
    """Return the name of a class of messages, ``package/msg/Name``."""
    package = message_class.__module__.split(".", 1)[0]
    return f"{package}/msg/{message_class.__name__}"


def definition_with_parts(kind: str) -> str:
    """Return the definition of ``package/msg/Name`` and, after it, those of all its parts.

    They are the files that packages install. Raises UnknownKindError, LookupError or OSError where
    they are not.
    """
    others = [
        f"{part.replace('/msg/', '/')}\n{_text(part)}"
        for part in _fields_of_parts(class_of_kind(kind))
        if part != kind
    ]
    return _SEPARATOR.join([_text(kind), *others])


def layout_of(message_class: Any) -> str:
    """Return a digest of the names and types of a message's fields, and of its parts' fields.

    Bytes of a message are read as they were meant by a class with the same digest. It may be a
    request of a service, too.
    """
    return _layout_of(message_class)


@functools.cache
def _layout_of(message_class: Any) -> str:
    fields = [message_class.get_fields_and_field_types(), _fields_of_parts(message_class)]
    return hashlib.blake2b(json.dumps(fields).encode(), digest_size=8).hexdigest()


def _fields_of_parts(message_class: Any) -> dict[str, dict[str, str]]:
    """Return the fields of all messages that a message is made of, each once, by their names."""
    found: dict[str, dict[str, str]] = {}
    waiting = [message_class.get_fields_and_field_types()]
    for fields in waiting:
        for field in fields.values():
            named = _NAMED.search(field)
            name = f"{named[1]}/msg/{named[2]}" if named else ""
            if name and name not in found:
                found[name] = class_of_kind(name).get_fields_and_field_types()
                waiting.append(found[name])
    return found


def _text(kind: str) -> str:
    package, _, name = kind.split("/")
    path = Path(get_package_share_directory(package)) / "msg" / f"{name}.msg"
    return path.read_text(encoding="utf8")
