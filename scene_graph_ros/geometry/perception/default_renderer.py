"""The renderer of cameras that are described without one: in scene files and in requests."""

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.perception.exact.exact_render_engine import ExactRenderEngine

__all__ = ["DEFAULT_RENDERER", "add_default_renderer"]

DEFAULT_RENDERER = "exact"
"""Its name."""


def add_default_renderer(scene_graph: SceneGraph) -> None:
    """Have our own renderer by that name, unless there is one of the name already."""
    if not scene_graph.has_renderer(DEFAULT_RENDERER):
        scene_graph.add_renderer(DEFAULT_RENDERER, ExactRenderEngine())
