"""Sets and options as YAML, each field by its name, and read again to the same values."""

from __future__ import annotations

from collections.abc import Mapping
import dataclasses
from typing import Any, TypeVar

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.affine_subspace import AffineSubspace
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.geometry.files import MAX_TEXT_BYTES
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["yaml_dump_typed", "yaml_load_typed"]

Value = TypeVar("Value")

_FIELDS: dict[str, tuple[type[ConvexSet], tuple[str, ...]]] = {
    kind.__name__: (kind, fields)
    for kind, fields in (
        (AffineBall, ("B", "center")),
        (AffineSubspace, ("basis", "translation")),
        (HPolyhedron, ("A", "b")),
        (Hyperellipsoid, ("A", "center")),
        (Hyperrectangle, ("lb", "ub")),
        (Point, ("x",)),
        (VPolytope, ("vertices",)),
    )
}
"""What sets are made of: arguments and properties alike."""

_KIND = "type"
"""The key of a set's class where it is the value of an option."""


def yaml_dump_typed(value: Any) -> str:
    """Return the YAML of a set, or of options such as `GraphOfConvexSetsOptions`.

    A mapping of its fields; numbers are read as they were. A set that is an option's value has its
    class below ``type``. Raises ConvexSetError for other sets and values, and for options that are
    functions, which YAML can't have.
    """
    import yaml

    return yaml.safe_dump(
        _fields_of(value, "yaml_dump_typed: value"),
        default_flow_style=None,
        sort_keys=False,
        width=1 << 20,
        allow_unicode=True,
    )


def yaml_load_typed(data: str, schema: type[Value]) -> Value:
    """Return a set or options of the class ``schema`` from YAML that `yaml_dump_typed` returns.

    Options that are not in it have their defaults. Raises ConvexSetError for what is no mapping,
    for fields that the class does not have, and as the class does.
    """
    import yaml

    label = f"yaml_load_typed: {getattr(schema, '__name__', quoted(schema))}"
    given: Any = data
    if not isinstance(given, str) or len(given) > MAX_TEXT_BYTES:
        raise ConvexSetError(
            f"{label}: data must be text of at most {MAX_TEXT_BYTES} characters, not"
            f" {quoted(data)}"
        )
    try:
        document = yaml.safe_load(data)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ConvexSetError(f"{label}: no YAML: {error}") from None
    made: Value = _made(document, schema, label)
    return made


def _fields_of(value: Any, label: str) -> dict[str, Any]:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: _plain(getattr(value, field.name), f"{label}.{field.name}")
            for field in dataclasses.fields(value)
            if field.init
        }
    known = _FIELDS.get(type(value).__name__)
    if known is None or type(value) is not known[0]:
        raise ConvexSetError(
            f"{label} must be options or one of {', '.join(_FIELDS)}, not {quoted(value)}"
        )
    return {name: _plain(getattr(value, name), label) for name in known[1]}


def _plain(value: Any, label: str) -> Any:
    """Return the value of a field as YAML has it."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, ConvexSet):
        return {_KIND: type(value).__name__, **_fields_of(value, label)}
    if isinstance(value, Mapping):
        return {str(key): _plain(each, f"{label}[{key!r}]") for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each, f"{label}[{k}]") for k, each in enumerate(value)]
    raise ConvexSetError(f"{label} can't be written as YAML: {quoted(value)}")


def _made(document: Any, schema: Any, label: str) -> Any:
    if not isinstance(document, dict):
        raise ConvexSetError(
            f"{label}: must be a mapping of fields, not a value of type {type(document).__name__}"
        )
    name = getattr(schema, "__name__", "")
    is_set = name in _FIELDS and _FIELDS[name][0] is schema
    if is_set:
        names: tuple[str, ...] = _FIELDS[name][1]
    elif dataclasses.is_dataclass(schema) and isinstance(schema, type):
        names = tuple(field.name for field in dataclasses.fields(schema) if field.init)
    else:
        raise ConvexSetError(
            f"{label}: schema must be a class of options or one of {', '.join(_FIELDS)}"
        )
    given = {key: value for key, value in document.items() if not (is_set and key == _KIND)}
    for key in given:
        if key not in names:
            raise ConvexSetError(f"{label} has no field {quoted(key)}")
    missing = [each for each in names if each not in given] if is_set else []
    if missing:
        raise ConvexSetError(f"{label}: {missing[0]} is missing")
    return schema(**{key: _value(each, f"{label}.{key}") for key, each in given.items()})


def _value(value: Any, label: str) -> Any:
    if isinstance(value, dict) and value.get(_KIND) in _FIELDS:
        return _made(value, _FIELDS[value[_KIND]][0], label)
    if isinstance(value, list):
        return [_value(each, label) for each in value]
    return value
