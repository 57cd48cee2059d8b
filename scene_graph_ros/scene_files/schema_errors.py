"""Describe errors of a scene file in words that point into the file."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files.yaml_document import path_text, YamlDocument

__all__ = ["located_error"]

_UNKNOWN = "extra_forbidden"
_MOST_UNKNOWN = 5
"""Unknown keys that are named: a file of something else has as many as lines."""
_LONGEST_KEY = 40
"""Characters of an unknown key that are repeated."""

_TEMPLATES = {
    "missing": "missing",
    "extra_forbidden": "unknown key",
    "greater_than": "must be greater than {gt:g}, got {input}",
    "greater_than_equal": "must be at least {ge:g}, got {input}",
    "less_than": "must be less than {lt:g}, got {input}",
    "less_than_equal": "must be at most {le:g}, got {input}",
    "finite_number": "must be finite, got {input}",
    "float_type": "must be a number, got {input}",
    "int_type": "must be an integer, got {input}",
    "string_type": "must be text, got {input}",
    "bool_type": "must be true or false, got {input}",
    "bool_parsing": "must be true or false, got {input}",
    "list_type": "must be a list, got {input}",
    "dict_type": "must be a mapping, got {input}",
    "model_type": "must be a mapping, got {input}",
    "model_attributes_type": "must be a mapping, got {input}",
    "string_too_short": "must not be empty, got {input}",
    "string_pattern_mismatch": "must not contain a slash, got {input}",
    "literal_error": "must be {expected}, got {input}",
    "union_tag_invalid": "must be one of {expected_tags}, got {tag!r}",
    "union_tag_not_found": "missing",
    "too_short": "must have at least {min_length} entries, got {actual_length}",
    "too_long": "must have at most {max_length} entries, got {actual_length}",
    "value_error": "{error}",
}


def _quoted(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _message(error: dict[str, Any]) -> str:
    context = error.get("ctx", {})
    if error["type"] == "greater_than" and context.get("gt") == 0:
        return f"must be positive, got {_quoted(error['input'])}"
    template = _TEMPLATES.get(error["type"])
    if template is None:
        return f"{error['msg']}, got {_quoted(error['input'])}"
    return template.format(**context, input=_quoted(error["input"]))


def _path(error: dict[str, Any], data: Any) -> tuple[str | int, ...]:
    """Return an error's path in the file, without the names of alternatives pydantic puts in."""
    path: list[str | int] = []
    current = data
    parts = error["loc"]
    for position, part in enumerate(parts):
        last = position == len(parts) - 1
        if (isinstance(current, dict) and part in current) or (
            isinstance(current, list) and isinstance(part, int) and part < len(current)
        ):
            path.append(part)
            current = current[part]
        elif last and error["type"] == "missing":
            path.append(part)
    if error["type"].startswith("union_tag"):
        path.append("type")
    return tuple(path)


def located_error(error: ValidationError, document: YamlDocument) -> SceneFileError:
    """Return an error with one line for each thing wrong, in the order of the file.

    Where a value fits none of several alternatives, the first one's complaint stands for all.
    """
    by_path: dict[tuple[str | int, ...], str] = {}
    unknown = 0
    for item in error.errors(include_url=False):
        details: dict[str, Any] = dict(item)
        path = _path(details, document.data)
        where = document.location(*path)
        if details["type"] == _UNKNOWN:
            unknown += 1
            if unknown > _MOST_UNKNOWN:
                continue
            where = replace(where, path=path_text((*path[:-1], _cut(path[-1]))))
        by_path.setdefault(path, f"{where}{': ' if where.path else ': scene '}{_message(details)}")

    def place(path: tuple[str | int, ...]) -> tuple[int, int]:
        return (document.location(*path).line or 0, list(by_path).index(path))

    problems = [by_path[path] for path in sorted(by_path, key=place)]
    if unknown > _MOST_UNKNOWN:
        problems.append(f"{document.file}: {unknown - _MOST_UNKNOWN} more unknown keys")
    return SceneFileError(problems)


def _cut(key: str | int) -> str | int:
    return f"{key[:_LONGEST_KEY]}..." if isinstance(key, str) and len(key) > _LONGEST_KEY else key
