"""A model's record of a renderer: the layers above say how it renders."""

from __future__ import annotations

from typing import Any, Protocol

__all__ = ["Renderer"]


class Renderer(Protocol):
    """The record of a renderer: a value that never changes, shared by all copies of a model."""

    @property
    def type_name(self) -> str:
        """The name of its class."""
        ...

    def parameter_yaml(self) -> str:
        """Return its parameters as YAML, below its type's name."""
        ...

    def render(self, *arguments: Any) -> Any:
        """Render images; see ``perception.engine``."""
        ...
