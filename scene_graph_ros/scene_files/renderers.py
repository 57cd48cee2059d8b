"""Turn renderers of a scene file into those of a scene graph."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from scene_graph_ros.geometry.errors import NameConflictError
from scene_graph_ros.geometry.perception import (
    ExactRenderEngine,
    GltfClientRenderEngine,
    LightParameter,
    RenderEngine,
    TracedRenderEngine,
)
from scene_graph_ros.geometry.perception.default_renderer import (
    add_default_renderer,
    DEFAULT_RENDERER,
)
from scene_graph_ros.located import suggestion
from scene_graph_ros.scene_files.application import Application
from scene_graph_ros.scene_files.schema_renderers import (
    ExactRendererSpec,
    GltfClientSpec,
    RendererSpec,
    TracedRendererSpec,
)

__all__ = ["added_renderers", "check_renderer_of_camera", "renderer_from_spec"]

_OF_FILES = ("name", "type", "lights")
"""Fields that are no parameters as they stand."""


def renderer_from_spec(spec: RendererSpec) -> RenderEngine:
    """Return the renderer. Raises EngineError for a parameter, or a missing package."""
    parameters = {
        field: value
        for field, value in spec.model_dump().items()
        if field not in _OF_FILES and value is not None
    }
    match spec:
        case ExactRendererSpec():
            return ExactRenderEngine(**parameters)
        case TracedRendererSpec():
            if spec.lights is not None:
                parameters["lights"] = tuple(
                    LightParameter(**light.model_dump()) for light in spec.lights
                )
            return TracedRenderEngine(**parameters)
        case GltfClientSpec():
            return GltfClientRenderEngine(**parameters)
    raise AssertionError(spec)


@contextmanager
def added_renderers(to: Application) -> Iterator[None]:
    """Add the renderers of a scene, and take them back where an error follows.

    Names are those of the file, without the prefix of its sources, as geometries name the
    renderers that draw them. One that is there already with the same parameters is shared.
    """
    added: list[str] = []
    try:
        for index, spec in enumerate(to.spec.renderers):
            with to.located("renderers", index):
                engine = renderer_from_spec(spec)
            with to.located("renderers", index, "name"):
                if _add(to, spec.name, engine):
                    added.append(spec.name)
        yield
        # After all that may fail: it stays where the rest is taken back.
        if to.spec.cameras:
            add_default_renderer(to.scene_graph)
    except BaseException:
        for name in added:
            to.scene_graph.remove_renderer(name)
        raise


def _add(to: Application, name: str, engine: RenderEngine) -> bool:
    """Add a renderer unless it is there; tell whether it was not."""
    if not to.scene_graph.has_renderer(name):
        to.scene_graph.add_renderer(name, engine)
        return True
    if to.scene_graph.renderer_parameter_yaml(name) != engine.parameter_yaml():
        raise NameConflictError(f"there is a renderer named {name!r} already, and it is another")
    return False


def check_renderer_of_camera(to: Application, index: int) -> None:
    """Raise SceneFileError, with the place, where a camera names a renderer that is not there."""
    name = to.spec.cameras[index].renderer
    known = {DEFAULT_RENDERER, *to.scene_graph.registered_renderer_names()}
    if name not in known:
        raise to.scene.document.error(
            f"there is no renderer {name!r}{suggestion(name, known)}", "cameras", index, "renderer"
        )
