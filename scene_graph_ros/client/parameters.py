"""Parameters of the node."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParametersAtomically
import yaml

from scene_graph_ros.client.connection import Connection, WorldError

__all__ = ["get_parameters", "set_parameter"]

_FIELDS = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array_value",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array_value",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array_value",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array_value",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array_value",
}


def get_parameters(connection: Connection, name: str | None = None) -> dict[str, Any]:
    """Return the parameters by name, or the one of a name. Raises WorldError."""
    listed = connection.call(ListParameters, "list_parameters", ListParameters.Request())
    names = sorted(listed.result.names)
    if name is not None:
        if name not in names:
            raise WorldError(
                f"{connection.target} has no parameter {name!r}, but {', '.join(names)}",
                "UNKNOWN_NAME",
            )
        names = [name]
    request = GetParameters.Request(names=names)
    values = connection.call(GetParameters, "get_parameters", request).values
    return {each: _plain(value) for each, value in zip(names, values, strict=True)}


def _plain(value: ParameterValue) -> Any:
    field = _FIELDS.get(value.type)
    found = None if field is None else getattr(value, field)
    return found if isinstance(found, (str, bool, int, float)) or found is None else list(found)


def set_parameter(connection: Connection, name: str, text: str) -> None:
    """Set a parameter to the value of a YAML text, of the type that it has. Raises WorldError."""
    before = get_parameters(connection, name)[name]
    try:
        given = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise WorldError(f"{name}: {text!r} is no YAML: {error}", "INVALID_ARGUMENT") from error
    if isinstance(before, str):
        given = text
    elif isinstance(before, float) and isinstance(given, int) and not isinstance(given, bool):
        given = float(given)
    parameter = Parameter(name=name, value=_value(given, before))
    request = SetParametersAtomically.Request(parameters=[parameter])
    result = connection.call(SetParametersAtomically, "set_parameters_atomically", request).result
    if not result.successful:
        raise WorldError(f"{name}: {result.reason}", "INVALID_ARGUMENT")


def _value(given: Any, before: Any) -> ParameterValue:
    first = given[0] if isinstance(given, list) and given else given
    kinds = {bool: "BOOL", int: "INTEGER", float: "DOUBLE", str: "STRING"}
    kind = kinds.get(type(first))
    if isinstance(given, list) and not given and isinstance(before, list):
        kind = kinds.get(type(before[0]) if before else str)
    if kind is None:
        raise WorldError(f"{given!r} is no value of a parameter", "INVALID_ARGUMENT")
    suffix = "_ARRAY" if isinstance(given, list) else ""
    number = getattr(ParameterType, f"PARAMETER_{kind}{suffix}")
    return ParameterValue(type=number, **{_FIELDS[number]: given})
