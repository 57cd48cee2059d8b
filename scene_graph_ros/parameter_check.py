"""The findings of `check` in one file of parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from scene_graph_ros.located import suggestion
from scene_graph_ros.node.runtime.names import NODE_NAME
from scene_graph_ros.node.runtime.parameter import GIVEN_BY_ROS
from scene_graph_ros.node.runtime.parameter_checks import validate
from scene_graph_ros.node.runtime.parameter_sections import full_name, reaches, sections_of
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.scene_files.yaml_document import YamlDocument

__all__ = ["ParameterFindings", "check_parameters"]


class ParameterFindings(NamedTuple):
    """Sentences on a file of parameters, each with its place."""

    errors: list[str]
    warnings: list[str]
    notes: list[str]
    scenes: list[tuple[str, str]]
    """The places and files of scenes that parameters without an error name."""
    taken: int
    """Parameters that the node takes."""


def check_parameters(document: YamlDocument, node: str) -> ParameterFindings:
    """Return the findings for a node's whole name; empty: the usual name in any namespace."""
    errors: list[str] = []
    warnings: list[str] = []
    notes: list[str] = []
    scenes: list[tuple[str, str]] = []
    count = 0
    for path, values in sections_of(document.data):
        place = document.location(*path)
        if not isinstance(values, dict):
            errors.append(f"{place}: must be a mapping")
        elif _reaches(path, node):
            count += len(values)
            wrong, unknown, ours = _check_values(document, path, values)
            errors += wrong
            warnings += unknown
            scene = ours.get("scene")
            if isinstance(scene, str) and scene and not errors:
                scenes.append((str(document.location(*path, "scene")), scene))
            if node:
                notes.append(f"{place}: {node} takes {', '.join(values)}")
        elif node:
            warnings.append(
                f"{place}: {node} takes none of these, which are for {full_name(path)}"
            )
        else:
            warnings.append(f"{place}: another node's, not checked")
    return ParameterFindings(errors, warnings, notes, scenes, count)


def _reaches(path: tuple[str | int, ...], node: str) -> bool:
    """Tell whether a section reaches the node, or one with this package's usual name."""
    if node:
        return reaches(path, node)
    return full_name(path).rpartition("/")[2] in (NODE_NAME, "*", "**")


def _check_values(
    document: YamlDocument, path: tuple[str | int, ...], values: Mapping[str, Any]
) -> tuple[list[str], list[str], dict[str, Any]]:
    """Return errors and warnings of a section's values, and those that are the node's."""
    known = [parameter.name for parameter in PARAMETERS]
    errors: list[str] = []
    warnings: list[str] = []
    ours = {}
    for name, value in values.items():
        if name.partition(".")[0] in GIVEN_BY_ROS:
            continue
        place = document.location(*path, name)
        if name not in known:
            warnings.append(f"{place}: nothing declares this parameter{suggestion(name, known)}")
            continue
        ours[name] = value
        problems = validate({name: value})
        errors += [f"{place}: {problem.removeprefix(f'{name} ')}" for problem in problems]
    if not errors:
        # Values that are wrong only together have no line of their own.
        errors.extend(f"{document.location(*path)}: {problem}" for problem in validate(ours))
    return errors, warnings, ours
