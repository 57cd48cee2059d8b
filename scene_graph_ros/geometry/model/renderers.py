"""The renderers of a model by name. Their work is known above; here they are only kept."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scene_graph_ros.geometry.errors import EngineError, NameConflictError
from scene_graph_ros.geometry.model.edit import Edit
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.model.renderer import Renderer
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["add_renderer", "find_renderer", "remove_renderer"]


_MEMBERS = ("type_name", "parameter_yaml", "render")


def add_renderer(edit: Edit, name: str, renderer: Any) -> None:
    """Keep a renderer under a name of its own."""
    state = edit.state
    label = canonical_name("renderer", name)
    missing = [member for member in _MEMBERS if not hasattr(renderer, member)]
    if missing or isinstance(renderer, type):
        lacks = f", which has no {', '.join(missing)}" if missing else ", a class"
        raise EngineError(
            f"renderer {label!r} must be a RenderEngine such as ExactRenderEngine(), not"
            f" {quoted(renderer)}{lacks}"
        )
    if label in state.renderers:
        raise NameConflictError(f"there is a renderer named {label!r} already")
    edit.set(state, "renderers", {**state.renderers, label: renderer})
    edit.changed()


def remove_renderer(edit: Edit, name: str) -> None:
    """Forget a renderer."""
    state = edit.state
    find_renderer(state.renderers, name)
    kept = {each: r for each, r in state.renderers.items() if each != name}
    edit.set(state, "renderers", kept)
    edit.changed()


def find_renderer(renderers: Mapping[str, Renderer], name: Any) -> Renderer:
    """Return the renderer of a name. Raises EngineError, naming those there are."""
    renderer = renderers.get(name) if isinstance(name, str) else None
    if renderer is None:
        raise EngineError(
            f"there is no renderer named {quoted(name)}; renderers: {sorted(renderers)}"
        )
    return renderer
