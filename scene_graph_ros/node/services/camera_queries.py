"""Images of cameras as answers; imported when one is first asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.cameras import camera_from_msg
from msg_adapters.errors import MessageError
from msg_adapters.images import camera_info_to_msg, FORMS, image_to_msg, ImageForm
from msg_adapters.labels import label_table_to_msg
from msg_adapters.poses import poses_to_msg
from msg_adapters.renderers import cost_of_pixel, renderer_from_msg
from scene_graph_msgs.msg import CameraDescription, RendererDescription
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.perception import (
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
    RenderEngine,
)
from scene_graph_ros.geometry.perception.default_renderer import DEFAULT_RENDERER
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.effects.camera_frame import optical_frame, parent_of
from scene_graph_ros.node.services.queries import QueryScope
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["render_images"]


class _View(NamedTuple):
    """A camera, its frame, its pose in that, and the frame of its images."""

    camera: DepthRenderCamera
    parent: Any
    X_PC: NDArray[np.float64]
    frame_id: str


def render_images(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer RenderImages."""
    snapshot, forms = scope.snapshot, _forms(request.images)
    view = _view(request, snapshot)
    core, engine = _renderer(request.renderer, view.camera.core, snapshot)
    lens = core.intrinsics
    pixels = lens.width * lens.height * len(scope.options.configurations)
    # What the scene has may cost what it costs.
    cost = cost_of_pixel(engine) if request.renderer.type else 1
    scope.require("max_pixels_per_request", pixels * cost, "pixels")
    kinds = frozenset().union(*(form.kinds for form in forms.values()))
    named: dict[str, Any] = {"stamp_ns": snapshot.stamp, "frame_id": view.frame_id}

    def answer(query: QueryObject) -> tuple[Any, NDArray[np.float64]]:
        X_WC = product(query.snapshot.pose_in_world(view.parent), view.X_PC)
        depth_range = view.camera.depth_range
        images = engine.render(query.snapshot, core, X_WC, kinds, depth_range)
        return {name: image_to_msg(f, lens, images, **named) for name, f in forms.items()}, X_WC

    answers = scope.each(answer)
    for name in forms:
        setattr(response, name, [messages[name] for messages, _ in answers])
    response.poses = poses_to_msg(np.array([X_WC for _, X_WC in answers]))
    response.camera_info = camera_info_to_msg(lens, **named)
    if forms.keys() & {"label", "points"}:
        version = snapshot.scene_version
        response.labels = label_table_to_msg(
            snapshot.inspector, snapshot.names, scene_version=version
        )


def _forms(images: list[str]) -> dict[str, ImageForm]:
    """Return the requested forms, each once. Raises MessageError."""
    names = ", ".join(FORMS)
    for name in images:
        if name not in FORMS:
            raise MessageError(f"images: {quoted(name)} is none of {names}")
    if not images:
        raise MessageError(f"images must be some of {names}, and is empty")
    return {name: FORMS[name] for name in images}


def _view(request: Any, snapshot: WorldSnapshot) -> _View:
    """Return the camera of the scene that a request names, or the one that it describes.

    Raises UnknownIdError for a camera or a frame that is not there, MessageError where both are
    given, and the errors of ``camera_from_msg``.
    """
    if not request.camera:
        camera, X_PC = camera_from_msg(request.description, DEFAULT_RENDERER)
        name = request.description.frame
        world = snapshot.inspector.world_frame_id()
        parent = world if name in ("", "world") else snapshot.names.frame_id(name)
        return _View(camera, parent, X_PC, "")
    if request.description != CameraDescription():
        raise MessageError(f"give camera or description, not both: camera is {request.camera!r}")
    found = snapshot.cameras.get(request.camera)
    if found is None:
        hint = suggestion(request.camera, snapshot.cameras)
        raise UnknownIdError(f"there is no camera {quoted(request.camera)}{hint}")
    parent = parent_of(found, snapshot)
    return _View(found.camera, parent, found.X_PC, optical_frame(found))


def _renderer(
    msg: RendererDescription, core: RenderCameraCore, snapshot: WorldSnapshot
) -> tuple[RenderCameraCore, RenderEngine]:
    """Return the renderer, and the camera with the renderer's name.

    Raises UnknownIdError for a renderer that is not there, MessageError for one that is named and
    described, and the errors of ``renderer_from_msg``.
    """
    if msg.name and (msg.type or msg.parameters):
        raise MessageError(
            f"give a renderer's name, or its type and parameters: renderer.name is"
            f" {quoted(msg.name)}, renderer.type {quoted(msg.type)}"
        )
    if msg.type or msg.parameters:
        return core, renderer_from_msg(msg, "renderer")
    name = msg.name or core.renderer_name
    renderers = snapshot.query.snapshot.state.renderers
    engine: Any = renderers.get(name)
    if engine is None and name == DEFAULT_RENDERER:
        # The default one is there also where the scene has no camera.
        engine = ExactRenderEngine()
    if engine is None:
        known = {DEFAULT_RENDERER, *renderers}
        raise UnknownIdError(f"there is no renderer {quoted(name)}{suggestion(name, known)}")
    return replace(core, renderer_name=name), engine
