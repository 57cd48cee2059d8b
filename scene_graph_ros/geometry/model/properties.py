"""Typed properties in named groups, one set per role of a geometry."""

from __future__ import annotations

import copy
from typing import Any, ClassVar, TypeVar

import numpy as np

from scene_graph_ros.geometry.errors import PropertyError
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.one_line import cut
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "GeometryProperties",
    "IllustrationProperties",
    "PerceptionProperties",
    "ProximityProperties",
    "make_phong_illustration_properties",
]

Self = TypeVar("Self", bound="GeometryProperties")


def _normalized(value: Any) -> Any:
    """Return a stored form that nobody else can change: numpy scalars as Python's, copies."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        value = value.copy()
        value.setflags(write=False)
        return value
    if isinstance(value, (bool, int, float, str, bytes, Rgba, frozenset)):
        return value
    return copy.deepcopy(value)


def _kept_type(value: Any) -> type:
    """Return the type in which a value is stored."""
    return type(value.item()) if isinstance(value, np.generic) else type(value)


def _check_names(*names: Any) -> None:
    """Raise PropertyError for a name of a group or property that is no text."""
    for name in names:
        if not isinstance(name, str):
            raise PropertyValueError(
                f"names of groups and properties must be non-empty text, not {quoted(name)}"
            )


def _same_value(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and np.array_equal(a, b)
    return type(a) is type(b) and a == b


class GeometryProperties:
    """Values found by (group, name). Spelling and type must be those the reader expects.

    The first value given to a property fixes its type: ``7`` and ``7.0`` differ. Every method that
    takes a name raises PropertyError for one that is no text.
    """

    role: ClassVar[Role] = Role.UNASSIGNED
    __slots__ = ("_groups", "_read_only")

    def __init__(self) -> None:
        if type(self) is GeometryProperties:
            raise TypeError("GeometryProperties is abstract: use ProximityProperties or another")
        self._groups: dict[str, dict[str, Any]] = {}
        self._read_only = False

    @staticmethod
    def default_group_name() -> str:
        """Return the name of the group for properties without a group of their own."""
        return "__default__"

    def add_property(self, group_name: str, name: str, value: Any) -> None:
        """Add a property, and its group if need be. Raises PropertyError if it exists."""
        if self.has_property(group_name, name):
            raise PropertyError(
                f"property ({group_name!r}, {name!r}) exists already:"
                f" {self._groups[group_name][name]!r}"
            )
        self._put(group_name, name, value)

    def update_property(self, group_name: str, name: str, value: Any) -> None:
        """Add a property, or replace the value of one that has the same type.

        Raises PropertyError if it exists with another type.
        """
        if self.has_property(group_name, name):
            old = self._groups[group_name][name]
            if type(old) is not _kept_type(value):
                raise PropertyError(
                    f"property ({group_name!r}, {name!r}) is of type {type(old).__name__}:"
                    f" cannot become {value!r} of type {type(value).__name__}"
                )
        self._put(group_name, name, value)

    def _put(self, group_name: str, name: str, value: Any) -> None:
        self._require_writable()
        if not (group_name and name):
            raise PropertyValueError(
                f"property ({group_name!r}, {name!r}): group and name must be non-empty text"
            )
        try:
            kept = _normalized(value)
        except (TypeError, ValueError, copy.Error) as error:
            raise PropertyValueError(
                f"property ({group_name!r}, {name!r}): no copy can be kept of {quoted(value)}:"
                f" {error}"
            ) from error
        self._groups.setdefault(group_name, {})[name] = kept

    def get_property(self, group_name: str, name: str, expected_type: type | None = None) -> Any:
        """Return the value of a property.

        An Rgba can be read with ``expected_type=numpy.ndarray`` as its four channels. Raises
        PropertyError if group or name is missing, or the value is of another type.
        """
        _check_names(group_name, name)
        group = self._groups.get(group_name)
        if group is None:
            raise PropertyError(
                f"there is no property group {group_name!r} for ({group_name!r}, {name!r});"
                f" groups: {sorted(self._groups)}"
            )
        if name not in group:
            raise PropertyError(
                f"there is no property ({group_name!r}, {name!r}); group has {sorted(group)}"
            )
        value = group[name]
        if expected_type is None or type(value) is expected_type:
            return value
        if expected_type is np.ndarray and isinstance(value, Rgba):
            return value.as_array()
        raise PropertyError(
            f"property ({group_name!r}, {name!r}) is {quoted(value)} of type"
            f" {type(value).__name__}, not {getattr(expected_type, '__name__', expected_type)}"
        )

    def get_property_or_default(self, group_name: str, name: str, default_value: Any) -> Any:
        """Return the value of a property, or the default if it is missing.

        Raises PropertyError if the property exists and is not of the default's type; a default
        of None accepts every type.
        """
        if not self.has_property(group_name, name):
            return default_value
        expected = None if default_value is None else _kept_type(default_value)
        return self.get_property(group_name, name, expected)

    def has_property(self, group_name: str, name: str) -> bool:
        """Tell whether the property exists."""
        _check_names(group_name, name)
        return name in self._groups.get(group_name, ())

    def has_group(self, group_name: str) -> bool:
        """Tell whether the group exists."""
        _check_names(group_name)
        return group_name in self._groups

    def remove_property(self, group_name: str, name: str) -> bool:
        """Remove a property; return whether it was there. Its group stays."""
        self._require_writable()
        if not self.has_property(group_name, name):
            return False
        del self._groups[group_name][name]
        return True

    def num_groups(self) -> int:
        """Count the groups."""
        return len(self._groups)

    def get_group_names(self) -> set[str]:
        """Return the names of all groups."""
        return set(self._groups)

    def get_properties_in_group(self, group_name: str) -> dict[str, Any]:
        """Return a copy of a group, values by name. Raises PropertyError if it is missing."""
        if not self.has_group(group_name):
            raise PropertyError(
                f"there is no property group {group_name!r}; groups: {sorted(self._groups)}"
            )
        return dict(self._groups[group_name])

    def copy(self: Self) -> Self:
        """Return an independent set that can be changed."""
        result = type(self)()
        result._groups = {group: dict(values) for group, values in self._groups.items()}
        return result

    def read_only_copy(self: Self) -> Self:
        """Return a set that refuses changes; a read-only set returns itself."""
        if self._read_only:
            return self
        result = self.copy()
        result._read_only = True
        return result

    def _require_writable(self) -> None:
        if self._read_only:
            raise PropertyError(
                f"these {type(self).__name__} belong to a registered geometry and are read-only:"
                " change a copy() and assign the role again with RoleAssign.REPLACE"
            )

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        if self._groups.keys() != other._groups.keys():
            return False
        return all(
            values.keys() == other._groups[group].keys()
            and all(_same_value(v, other._groups[group][n]) for n, v in values.items())
            for group, values in self._groups.items()
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return cut(f"{type(self).__name__}({self._groups!r})")


class ProximityProperties(GeometryProperties):
    """Properties for collision, distance and contact.

    ``("mesh", "representation")``: the body of a Mesh in point contact and distance between
    geometries, ``"convex_hull"`` (default) or ``"triangles"``. ``("mesh", "repair_tolerance")``:
    how large gaps of a Mesh are closed, as a part of its size, 1e-6 by default. ``("mesh",
    "solid")``: ``"required"`` refuses a Mesh that is not closed, ``"if_closed"`` (default) not.
    ``("mesh", "pieces")``: a Mesh means the union of the convex hulls of its pieces everywhere,
    which are the ``"objects"`` of an OBJ file, or those that ``"coacd"`` splits it into;
    ``"pieces_threshold"`` (0.05; how concave a piece may be, as a part of the size) and
    ``"pieces_seed"`` (0) are CoACD's.
    """

    role = Role.PROXIMITY
    __slots__ = ()


class IllustrationProperties(GeometryProperties):
    """Properties for drawing. ``("phong", "diffuse")`` is the colour, an Rgba."""

    role = Role.ILLUSTRATION
    __slots__ = ()


class PerceptionProperties(GeometryProperties):
    """Properties for cameras.

    ``("phong", "diffuse")`` is the colour, an Rgba or three or four numbers; ``("phong",
    "diffuse_map")`` the path of a picture on it, a PNG or JPEG file, which ``("phong",
    "diffuse_scale")``, two numbers, repeats so often along each side; ``("label", "id")``
    a RenderLabel or a whole number; ``("renderer", "accepting")`` the set of names of the
    renderers that draw the geometry: all do without it, or if it is empty.
    """

    role = Role.PERCEPTION
    __slots__ = ()


def make_phong_illustration_properties(diffuse: Any) -> IllustrationProperties:
    """Return illustration properties with the colour ``diffuse``: an Rgba or 3 or 4 numbers."""
    properties = IllustrationProperties()
    properties.add_property("phong", "diffuse", Rgba.from_value(diffuse))
    return properties
