"""Renderers of requests as type and parameters, in the words of scene files."""

from __future__ import annotations

from pydantic import TypeAdapter, ValidationError

from scene_graph_ros.geometry.model.renderer import Renderer
from scene_graph_ros.geometry.perception import RenderEngine
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files.renderers import renderer_from_spec
from scene_graph_ros.scene_files.schema_errors import located_error
from scene_graph_ros.scene_files.schema_renderers import RendererSpec
from scene_graph_ros.scene_files.yaml_document import parse_yaml, YamlDocument

__all__ = ["renderer_from_text", "renderer_to_text"]

_TYPES = {
    "ExactRenderEngine": "exact",
    "TracedRenderEngine": "traced",
    "GltfClientRenderEngine": "gltf_client",
}
_BESIDE = ("name", "type")
"""What is said beside the parameters."""


def renderer_from_text(kind: str, parameters: str, label: str) -> RenderEngine:
    """Return a renderer of a type of scene files, with parameters as they have them, as YAML.

    Raises SceneFileError, with ``label``, line and name, for parameters that it does not have or
    values that they can't have, EngineError for one that is not installed.
    """
    document = parse_yaml(parameters, label)
    given = {} if document.data is None else document.data
    if not isinstance(given, dict):
        raise SceneFileError(f"{label}: must be a mapping of parameters")
    for name in _BESIDE:
        if name in given:
            raise document.error("is no parameter, but a field of its own", name)
    try:
        spec = TypeAdapter(RendererSpec).validate_python({**given, "name": "-", "type": kind})
    except ValidationError as error:
        raise located_error(error, YamlDocument(label, given, document.lines)) from error
    return renderer_from_spec(spec)


def renderer_to_text(engine: Renderer) -> tuple[str, str]:
    """Return a renderer's type and parameters, fit for ``renderer_from_text``.

    Those of one that asks a server are left out: its address is nobody's business.
    """
    kind = _TYPES.get(engine.type_name, engine.type_name)
    if kind == "gltf_client":
        return kind, ""
    _, *lines = engine.parameter_yaml().splitlines()
    return kind, "".join(f"{line.strip()}\n" for line in lines)
