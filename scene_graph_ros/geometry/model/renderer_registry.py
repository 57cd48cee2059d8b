"""The part of a scene graph that is about renderers."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from scene_graph_ros.geometry.model import renderers
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.owner import ModelOwner
from scene_graph_ros.geometry.model.renderers import Renderer

__all__ = ["RendererRegistry"]


class RendererRegistry:
    """Renderers by name. They are values that never change, so contexts and clones share them."""

    def _owner(self, context: Context | None) -> ModelOwner:
        raise NotImplementedError

    def add_renderer(
        self, name: str, renderer: Renderer, *, context: Context | None = None
    ) -> None:
        """Let cameras use a renderer, such as ``perception.ExactRenderEngine()``, by a name.

        It makes no difference whether geometry comes before it or after. Raises NameConflictError
        for a name that is taken or no name, EngineError for other objects.
        """
        self._owner(context).change(renderers.add_renderer, name, renderer)

    def remove_renderer(self, name: str, *, context: Context | None = None) -> None:
        """Remove a renderer. Raises EngineError if there is none of that name."""
        self._owner(context).change(renderers.remove_renderer, name)

    def has_renderer(self, name: Any, *, context: Context | None = None) -> bool:
        """Tell whether there is a renderer of that name."""
        return isinstance(name, Hashable) and name in self._owner(context).state.renderers

    def renderer_count(self, *, context: Context | None = None) -> int:
        """Count the renderers."""
        return len(self._owner(context).state.renderers)

    def registered_renderer_names(self, *, context: Context | None = None) -> list[str]:
        """Return the names of all renderers, in the order in which they were added."""
        return list(self._owner(context).state.renderers)

    def renderer_type_name(self, name: str, *, context: Context | None = None) -> str:
        """Return the name of a renderer's class. Raises EngineError if there is none."""
        return renderers.find_renderer(self._owner(context).state.renderers, name).type_name

    def renderer_parameter_yaml(self, name: str, *, context: Context | None = None) -> str:
        """Return a renderer's parameters as YAML. Raises EngineError if there is none."""
        known = self._owner(context).state.renderers
        return renderers.find_renderer(known, name).parameter_yaml()
