"""YAML whose values know their line.

Scalars follow YAML 1.2's core schema, so ``off`` is text and ``1e-3`` a number. Keys are text and
unique; tags for objects are refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import re
from typing import Any, ClassVar

import yaml

from scene_graph_ros.geometry.files import MAX_TEXT_BYTES
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.steps import between_steps
from scene_graph_ros.located import Location, SceneFileError

__all__ = ["YamlDocument", "parse_yaml", "path_text"]

Path = tuple[str | int, ...]

MAX_VALUES = 1_000_000
"""Aliases let a small file describe an exponential number of values; more than this is refused."""

MAX_DEPTH = 100
"""How many lists and mappings may be in each other. Scenes have about ten."""


class _Loader(yaml.SafeLoader):
    """SafeLoader with the scalars of YAML 1.2's core schema."""

    # The base class declares the table as an instance's, but looks it up in the class.
    yaml_implicit_resolvers: ClassVar[dict[str, Any]] = {}  # type: ignore[misc]

    def __init__(self, text: str | bytes) -> None:
        super().__init__(text)
        self.depth = self.count = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a node and all in it, as long as they are neither too deep nor too many."""
        between_steps()
        self.depth += 1
        self.count += 1
        if self.depth > MAX_DEPTH:
            self._refuse(f"nested more than {MAX_DEPTH} deep")
        if self.count > MAX_VALUES:
            self._refuse(f"more than {MAX_VALUES} values")
        node: yaml.Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def _refuse(self, problem: str) -> None:
        raise yaml.composer.ComposerError(None, None, problem, self.peek_event().start_mark)


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

    @property
    def lines(self) -> dict[tuple[str | int, ...], int]:
        """The line of each value, by its path."""
        return self._lines

    def location(self, *path: str | int) -> Location:
        """Return the location of the value at ``path``, or of the nearest value around it."""
        for length in range(len(path), -1, -1):
            line = self._lines.get(path[:length])
            if line is not None:
                return Location(self.file, line, path_text(path))
        return Location(self.file, None, path_text(path))

    def error(self, message: str, *path: str | int) -> SceneFileError:
        """Return an error that names file, line and path."""
        return SceneFileError(f"{self.location(*path)}: {message}")


def parse_yaml(text: str | bytes, file: str, *, is_quoted: bool = True) -> YamlDocument:
    """Parse a YAML text; ``file`` is its name in messages.

    Where it is not ``is_quoted``, messages repeat nothing of a text that can't be parsed.

    Raises SceneFileError as ``_parsed`` does.
    """
    try:
        return _parsed(text, file)
    except SceneFileError:
        if is_quoted:
            raise
        remedy = "`python -m scene_graph_ros.check` says why to who may read it"
        raise SceneFileError(f"{file}: is no YAML that can be read; {remedy}") from None


def _parsed(text: str | bytes, file: str) -> YamlDocument:
    """Parse a YAML text.

    Raises SceneFileError, with the line, for text that is no YAML, keys that are given twice or
    no text, tags for objects, aliases that contain themselves, and for values, aliased and merged
    ones included, that are more than MAX_VALUES or deeper than MAX_DEPTH; and for a text of more
    than MAX_TEXT_BYTES.
    """
    if len(text) > MAX_TEXT_BYTES:
        raise SceneFileError(f"{file}: has {len(text)} characters, the limit is {MAX_TEXT_BYTES}")
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
        self.merge = _Merge(self.fail)

    def fail(self, node: yaml.Node, path: Path, message: str) -> SceneFileError:
        place = Location(self.file, node.start_mark.line + 1, path_text(path))
        return SceneFileError(f"{place}: {message}")

    def build(self, node: yaml.Node, path: Path) -> Any:
        """Return the value of a node, and remember the lines of all values in it."""
        if node.tag not in _PLAIN_TAGS:
            raise self.fail(node, path, f"the tag {quoted(node.tag)} is refused")
        if id(node) in self.open:
            raise self.fail(node, path, "an alias contains itself")
        between_steps()
        self.lines[path] = node.start_mark.line + 1
        if len(self.lines) > MAX_VALUES:
            raise self.fail(node, path, f"more than {MAX_VALUES} values")
        if len(self.open) >= MAX_DEPTH:
            raise self.fail(node, path, f"nested more than {MAX_DEPTH} deep")
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
        result = {}
        for name, (key, value) in self.merge.entries(node, path).items():
            result[name] = self.build(value, (*path, name))
            # A value on the lines below its key is best pointed at by the key.
            self.lines[(*path, name)] = key.start_mark.line + 1
        return result


Entries = dict[str, tuple[yaml.Node, yaml.Node]]
"""The key's and the value's node by the key."""


class _Merge:
    """The content of mappings when the merge keys (``<<``) in them are followed.

    Each mapping is worked out once and has each key once, so that mappings which merge mappings
    do not multiply.
    """

    def __init__(self, fail: Callable[[yaml.Node, Path, str], SceneFileError]) -> None:
        self.fail = fail
        self.known: dict[int, Entries] = {}
        self.open: list[int] = []
        self.visited = 0

    def entries(self, node: yaml.MappingNode, path: Path) -> Entries:
        """Return a mapping's entries: merged ones first, its own in place of those."""
        if id(node) in self.known:
            return self.known[id(node)]
        if id(node) in self.open:
            raise self.fail(node, path, "an alias contains itself")
        if len(self.open) >= MAX_DEPTH:
            raise self.fail(node, path, f"merges more than {MAX_DEPTH} deep")
        self.open.append(id(node))
        result: Entries = {}
        for entries in (*self._merged(node, path), self._own(node, path)):
            self.visited += len(entries)
            if self.visited > MAX_VALUES:
                raise self.fail(node, path, f"more than {MAX_VALUES} values, with those merged")
            result.update(entries)
        self.open.pop()
        self.known[id(node)] = result
        return result

    def _merged(self, node: yaml.MappingNode, path: Path) -> Iterator[Entries]:
        """Yield the mappings that one merges; of a list, the first comes last, and wins."""
        for key, value in node.value:
            if key.tag != _MERGE:
                continue
            parts = value.value if isinstance(value, yaml.SequenceNode) else [value]
            for part in reversed(parts):
                if not isinstance(part, yaml.MappingNode):
                    raise self.fail(part, path, "<< takes a mapping or a list of mappings")
                yield self.entries(part, path)

    def _own(self, node: yaml.MappingNode, path: Path) -> Entries:
        result: Entries = {}
        for key, value in node.value:
            if key.tag == _MERGE:
                continue
            if key.tag != _STR:
                raise self.fail(key, path, f"keys must be text, got {quoted(key.value)}")
            if key.value in result:
                first = result[key.value][0].start_mark.line + 1
                message = f"given twice, first in line {first}"
                raise self.fail(key, (*path, key.value), message)
            result[key.value] = (key, value)
        return result
