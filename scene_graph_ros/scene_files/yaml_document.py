"""YAML whose values know their line.

Scalars follow YAML 1.2's core schema, so ``off`` is text and ``1e-3`` a number. Keys are text and
unique; tags for objects are refused.
"""

from __future__ import annotations

import re
from typing import Any, ClassVar

import yaml

from scene_graph_ros.scene_files.errors import Location, SceneFileError

__all__ = ["YamlDocument", "parse_yaml", "path_text"]

Path = tuple[str | int, ...]

MAX_VALUES = 1_000_000
"""Aliases let a small file describe an exponential number of values; more than this is refused."""


class _Loader(yaml.SafeLoader):
    """SafeLoader with the scalars of YAML 1.2's core schema."""

    # The base class declares the table as an instance's, but looks it up in the class.
    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {}  # type: ignore[misc]


_STR = "tag:yaml.org,2002:str"
_MERGE = "tag:yaml.org,2002:merge"
for _tag, _pattern, _first in (
    ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", list("tTfF")),
    ("int", r"^[-+]?[0-9]+$", list("-+0123456789")),
    (
        "float",
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
        list("-+.0123456789"),
    ),
    ("merge", r"^<<$", ["<"]),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(_pattern), _first)


def _construct_int(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    # YAML 1.1 would read 010 as eight.
    return int(loader.construct_scalar(node))


def _construct_float(loader: yaml.SafeLoader, node: yaml.ScalarNode) -> float:
    text = loader.construct_scalar(node).lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)
_Loader.add_constructor("tag:yaml.org,2002:float", _construct_float)
_PLAIN_TAGS = frozenset(
    f"tag:yaml.org,2002:{name}" for name in ("null", "bool", "int", "float", "str", "map", "seq")
)


def path_text(path: Path) -> str:
    """Write a path as ``geometries[3].shape.radius``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += f".{part}" if text else part
    return text


class YamlDocument:
    """The values of a file as dicts, lists and scalars, and the line of each of them."""

    def __init__(self, file: str, data: Any, lines: dict[Path, int]) -> None:
        self.file = file
        self.data = data
        self._lines = lines

    def location(self, *path: str | int) -> Location:
        """Return where the value at ``path`` is, or where the nearest value around it is."""
        for length in range(len(path), -1, -1):
            line = self._lines.get(path[:length])
            if line is not None:
                return Location(self.file, line, path_text(path))
        return Location(self.file, None, path_text(path))

    def error(self, message: str, *path: str | int) -> SceneFileError:
        """Return an error that names file, line and path."""
        return SceneFileError(f"{self.location(*path)}: {message}")


def parse_yaml(text: str | bytes, file: str) -> YamlDocument:
    """Parse a YAML text; ``file`` is its name in messages.

    Raises SceneFileError, with the line, for text that is no YAML, keys that are given twice or
    no text, tags for objects, and aliases that contain themselves or grow beyond MAX_VALUES.
    """
    try:
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            builder = _Builder(loader, file)
            data = None if node is None else builder.build(node, ())
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        line = None if error.problem_mark is None else error.problem_mark.line + 1
        raise SceneFileError(f"{Location(file, line)}: not YAML: {error.problem}") from error
    except yaml.YAMLError as error:
        raise SceneFileError(f"{file}: not YAML: {error}") from error
    return YamlDocument(file, data, builder.lines)


class _Builder:
    def __init__(self, loader: _Loader, file: str) -> None:
        self.loader = loader
        self.file = file
        self.lines: dict[Path, int] = {}
        self.open: list[int] = []

    def fail(self, node: yaml.Node, path: Path, message: str) -> SceneFileError:
        place = Location(self.file, node.start_mark.line + 1, path_text(path))
        return SceneFileError(f"{place}: {message}")

    def build(self, node: yaml.Node, path: Path) -> Any:
        """Return the value of a node, and remember the lines of all values in it."""
        if node.tag not in _PLAIN_TAGS:
            raise self.fail(node, path, f"the tag {node.tag!r} is refused")
        if id(node) in self.open:
            raise self.fail(node, path, "an alias contains itself")
        self.lines[path] = node.start_mark.line + 1
        if len(self.lines) > MAX_VALUES:
            raise self.fail(node, path, f"more than {MAX_VALUES} values")
        self.open.append(id(node))
        try:
            if isinstance(node, yaml.MappingNode):
                return self._mapping(node, path)
            if isinstance(node, yaml.SequenceNode):
                return [self.build(item, (*path, i)) for i, item in enumerate(node.value)]
            return self._scalar(node, path)
        finally:
            self.open.pop()

    def _scalar(self, node: yaml.Node, path: Path) -> Any:
        try:
            return self.loader.construct_object(node)
        except ValueError as error:
            raise self.fail(node, path, f"{error}") from error

    def _mapping(self, node: yaml.MappingNode, path: Path) -> dict[str, Any]:
        seen: dict[str, int] = {}
        for key, _ in node.value:
            if key.tag == _MERGE:
                continue
            if key.tag != _STR:
                raise self.fail(key, path, f"keys must be text, got {key.value!r}")
            if key.value in seen:
                message = f"given twice, first in line {seen[key.value]}"
                raise self.fail(key, (*path, key.value), message)
            seen[key.value] = key.start_mark.line + 1
        self.loader.flatten_mapping(node)
        result = {}
        for key, value in node.value:
            result[key.value] = self.build(value, (*path, key.value))
            # A value on the lines below its key is best pointed at by the key.
            self.lines[(*path, key.value)] = key.start_mark.line + 1
        return result
