"""Refuse mesh files that promise more than they hold, or unfold to more than anybody wants.

Parsers take memory for a header's numbers and follow references as often as they are made, so
that a small file can cost all memory. The sum is counted here first.
"""

from __future__ import annotations

from collections.abc import Callable
import json
import re
from typing import Any
from xml.parsers import expat

from scene_graph_ros.geometry.errors import MeshError

__all__ = [
    "MAX_CORNERS",
    "MAX_PLACES",
    "check_is_no_pointer",
    "check_is_there",
    "check_promises",
]

MAX_CORNERS = 20_000_000
"""Vertices, and triangles, of all bodies of a file. Twenty million take half a gigabyte each."""

MAX_PLACES = 100_000
"""How often the bodies of a COLLADA file may be placed."""

_MOST_VISITS = 10 * MAX_PLACES
"""How often its nodes may be: those that place no body take time, too."""

_MAX_DEPTH = 100

MAX_NODE_DEPTH = 500
"""How deep the nodes of a glTF file may be in each other: each takes its parents' poses anew."""

_NONSENSE = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)
"""What a document of JSON raises that is not what it should be; 1e999 is a number there."""


_LFS_POINTER = b"version https://git-lfs.github.com/spec/"


def check_is_there(contents: bytes, name: str) -> None:
    """Raise MeshError for an empty file, and for a pointer of Git LFS instead of the file."""
    if not contents.strip():
        raise MeshError(f"{name}: the file is empty")
    check_is_no_pointer(contents, name)


def check_is_no_pointer(contents: bytes, name: str) -> None:
    """Raise MeshError for a pointer of Git LFS instead of a file."""
    if contents.startswith(_LFS_POINTER):
        raise MeshError(f"{name}: a Git LFS pointer, not the file itself: run git lfs pull")


def check_promises(contents: bytes, file_type: str, name: str) -> None:
    """Raise MeshError, naming the file and the count, for files that no parser should see."""
    check = _CHECKS.get(file_type)
    if check is not None:
        check(contents, name)


def _check_ply(contents: bytes, name: str) -> None:
    """Compare the counts of elements with the file's size: each takes a byte at least."""
    header = contents[: contents.find(b"end_header")]
    for line in header.splitlines():
        words = line.split()
        if words[:1] != [b"element"] or len(words) != 3 or not words[2].isdigit():
            continue
        # The count may have millions of digits, which is no number yet.
        if len(words[2]) > 12 or int(words[2]) > len(contents):
            stated = b" ".join(words)[:60].decode(errors="replace")
            raise MeshError(f"{name}: {len(contents)} bytes can't hold what it states: {stated}")


def _check_glb(contents: bytes, name: str) -> None:
    version, size = (int.from_bytes(contents[k : k + 4], "little") for k in (4, 8))
    if contents[:4] != b"glTF":
        raise MeshError(f"{name}: unreadable glb: it does not begin as a GLB file does")
    if version != 2 or contents[16:20] != b"JSON":
        raise MeshError(f"{name}: unreadable glb: of version {version}, not 2, or without JSON")
    if size > len(contents):
        raise MeshError(f"{name}: it has {len(contents)} bytes, of {size} that it states")
    length = int.from_bytes(contents[12:16], "little")
    _check_gltf(contents[20 : 20 + length], name)


def _check_gltf(contents: bytes, name: str) -> None:
    """Accessors state counts, and nodes place bodies as often as they like."""
    try:
        tree = json.loads(contents)
        count = _corners_of_gltf(tree)
        _check_nodes(tree.get("nodes", ()), name)
    except MeshError:
        raise
    except _NONSENSE as error:
        raise MeshError(f"{name}: unreadable glTF: {error!r}"[:500]) from error
    if count > MAX_CORNERS:
        raise MeshError(f"{name}: it states {count} vertices and corners, more than {MAX_CORNERS}")


def _corners_of_gltf(tree: Any) -> int:
    """Count vertices and corners: of the bodies, and again wherever one is placed."""
    counts = [int(accessor["count"]) for accessor in tree.get("accessors", ())]
    if counts and min(counts) < 0:
        raise ValueError(f"an accessor's count is {min(counts)}")
    in_memory = [a["count"] for a in tree.get("accessors", ()) if "bufferView" not in a]
    total, bodies = sum(in_memory), []
    for mesh in tree.get("meshes", ()):
        used = [i for p in mesh["primitives"] for i in p.get("attributes", {}).values()]
        used += [p["indices"] for p in mesh["primitives"] if "indices" in p]
        bodies.append(sum(counts[i] for i in used))
    placed = [node["mesh"] for node in tree.get("nodes", ()) if "mesh" in node]
    return int(total + sum(bodies) + sum(bodies[i] for i in placed))


def _check_nodes(nodes: Any, name: str) -> None:
    """Raise MeshError for nodes that are too deep in each other, or in themselves."""
    if len(nodes) > MAX_PLACES:
        raise MeshError(f"{name}: it has {len(nodes)} nodes, more than {MAX_PLACES}")
    parents = dict[int, int]()
    for index, node in enumerate(nodes):
        for child in node.get("children", ()):
            if parents.setdefault(int(child), index) != index:
                raise MeshError(f"{name}: node {child} has two parents")
    level = [index for index in range(len(nodes)) if index not in parents]
    reached = 0
    for _ in range(MAX_NODE_DEPTH):
        reached += len(level)
        level = [int(child) for index in level for child in nodes[index].get("children", ())]
    if level or reached < len(nodes):
        raise MeshError(
            f"{name}: its nodes are more than {MAX_NODE_DEPTH} deep in each other, or in loops"
        )


def _check_dae(contents: bytes, name: str) -> None:
    """COLLADA places nodes in nodes, each as often as it likes: a tree of doublings."""
    nodes = _ColladaNodes(name)
    try:
        nodes.parser.Parse(contents, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"{name}: unreadable dae: {error}") from error
    counted = [nodes.places(key, 0) for key in nodes.top]
    count, visits = (sum(each[k] for each in counted) for k in range(2))
    if count > MAX_PLACES:
        raise MeshError(f"{name}: it places bodies {count} times, more than {MAX_PLACES}")
    if visits > _MOST_VISITS:
        raise MeshError(f"{name}: it places nodes {visits} times, more than {_MOST_VISITS}")


class _ColladaNodes:
    """How many bodies each node places, itself and through the nodes it refers to."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.depth = 0
        self.open: list[str] = []
        self.top: list[str] = []
        self.bodies: dict[str, int] = {}
        self.inner: dict[str, list[str]] = {}
        self.known: dict[str, tuple[int, int]] = {}
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.EntityDeclHandler = self.entity

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            line = self.parser.CurrentLineNumber
            raise MeshError(f"{self.name}: line {line}: nested more than {_MAX_DEPTH} deep")
        tag = tag.rpartition(":")[2]
        if tag == "node":
            self._open(attributes.get("id") or f"no id: {len(self.bodies)}")
        elif self.open and tag == "instance_node":
            self.inner[self.open[-1]].append(attributes.get("url", "").lstrip("#"))
        elif self.open and tag.startswith("instance_"):
            self.bodies[self.open[-1]] += 1

    def _open(self, key: str) -> None:
        if self.open:
            self.inner[self.open[-1]].append(key)
        else:
            self.top.append(key)
        self.bodies.setdefault(key, 0)
        self.inner.setdefault(key, [])
        self.open.append(key)

    def end(self, tag: str) -> None:
        self.depth -= 1
        if tag.rpartition(":")[2] == "node":
            self.open.pop()

    def entity(self, name: str, *_details: object) -> None:
        raise MeshError(f"{self.name}: entity {name[:60]!r}: entities are refused")

    def places(self, key: str, depth: int) -> tuple[int, int]:
        """Count the bodies and the nodes, with itself, that a node places.

        Raises MeshError where that has no end.
        """
        if depth > _MAX_DEPTH:
            raise MeshError(f"{self.name}: nodes refer to nodes more than {_MAX_DEPTH} deep")
        if key not in self.known:
            inner = [self.places(other, depth + 1) for other in self.inner.get(key, ())]
            bodies = self.bodies.get(key, 0) + sum(each[0] for each in inner)
            self.known[key] = bodies, 1 + sum(each[1] for each in inner)
        return self.known[key]


_VTK_DATASET = re.compile(rb"^[ \t\r\f\v]*DATASET\s+(\w+)", re.MULTILINE | re.IGNORECASE)
_VTK_COUNT = re.compile(
    rb"^[ \t\r\f\v]*(?:POINTS|CELLS|CELL_TYPES|POINT_DATA|CELL_DATA)[ \t]+(\d+)(?:[ \t]+(\d+))?",
    re.MULTILINE | re.IGNORECASE,
)


def _check_vtk(contents: bytes, name: str) -> None:
    """Compare counts in words with the file's size; regular grids make points of three numbers."""
    dataset = _VTK_DATASET.search(contents)
    kind = dataset[1].decode().upper() if dataset else "UNSTRUCTURED_GRID"
    if kind != "UNSTRUCTURED_GRID":
        raise MeshError(f"{name}: tetrahedra are in an UNSTRUCTURED_GRID, not in {kind[:60]}")
    for match in _VTK_COUNT.finditer(contents):
        for count in match.groups(b"0"):
            if len(count) > 12 or int(count) > len(contents):
                stated = b" ".join(match[0].split())[:60].decode(errors="replace")
                raise MeshError(
                    f"{name}: {len(contents)} bytes can't hold what it states: {stated}"
                )


_CHECKS: dict[str, Callable[[bytes, str], None]] = {
    "dae": _check_dae,
    "glb": _check_glb,
    "gltf": _check_gltf,
    "ply": _check_ply,
    "vtk": _check_vtk,
}
