"""Renderers that requests describe, and those of the scene back to messages."""

from __future__ import annotations

import math

from msg_adapters.errors import MessageError
from scene_graph_msgs.msg import RendererDescription
from scene_graph_ros.geometry.model.renderer import Renderer
from scene_graph_ros.geometry.perception import RenderEngine, TracedRenderEngine
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.scene_files.renderer_texts import renderer_from_text, renderer_to_text

__all__ = ["MAX_REQUESTED_SAMPLES", "cost_of_pixel", "renderer_from_msg", "renderer_to_msg"]

MAX_REQUESTED_SAMPLES = 256
"""Of a pixel, by a renderer that a request brings along; of surfaces on a path a sixteenth."""

_DEFAULT = TracedRenderEngine()


def renderer_from_msg(msg: RendererDescription, label: str) -> RenderEngine:
    """Return the renderer that a request describes; ``label`` is its name in messages.

    Raises MessageError for a type that requests can't have and for more samples than they may ask
    for, and the errors of ``renderer_from_text``.
    """
    if msg.type == "gltf_client":
        raise MessageError(
            f"{label}.type: 'gltf_client': the node asks a render server only where the scene says"
            " so that it starts with, its parameter 'scene'"
        )
    if msg.type not in ("exact", "traced"):
        raise MessageError(f"{label}.type must be 'exact' or 'traced', not {quoted(msg.type)}")
    engine = renderer_from_text(msg.type, msg.parameters, f"{label}.parameters")
    if isinstance(engine, TracedRenderEngine):
        for name, most in (
            ("samples", MAX_REQUESTED_SAMPLES),
            ("max_depth", MAX_REQUESTED_SAMPLES // 16),
        ):
            if getattr(engine, name) > most:
                raise MessageError(
                    f"{label}.parameters: {name} is {getattr(engine, name)}, and requests may ask"
                    f" for {most} at most"
                )
    return engine


def renderer_to_msg(name: str, engine: Renderer) -> RendererDescription:
    """Return the description of a renderer; it makes the same again."""
    kind, parameters = renderer_to_text(engine)
    return RendererDescription(name=name, type=kind, parameters=parameters)


def cost_of_pixel(engine: Renderer) -> int:
    """Return as how many pixels one counts where a limit is on pixels: 1 by default parameters."""
    if not isinstance(engine, TracedRenderEngine):
        return 1
    shares = engine.samples / _DEFAULT.samples, engine.max_depth / _DEFAULT.max_depth
    return math.prod(max(1, math.ceil(share)) for share in shares)
