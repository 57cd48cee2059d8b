"""Answer the queries of cameras about one snapshot."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.model.renderers import find_renderer
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.perception.camera import ColorRenderCamera, DepthRenderCamera
from scene_graph_ros.geometry.perception.engine import ImageKind, Images, RenderEngine
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import as_pose, compose

__all__ = ["render_images", "render_one"]

_CAMERAS = {
    ImageKind.COLOR: ColorRenderCamera,
    ImageKind.DEPTH: DepthRenderCamera,
    ImageKind.LABEL: ColorRenderCamera,
}


def render_one(
    snapshot: Snapshot, kind: str, camera: Any, parent_frame: FrameId, X_PC: Any
) -> Any:
    """Return an image of one kind, from the camera that is for it. Raises QueryArgumentError."""
    wanted = _CAMERAS[ImageKind(kind)]
    if not isinstance(camera, wanted):
        raise QueryArgumentError(
            f"render_{kind}_image: camera must be a {wanted.__name__}, not {quoted(camera)}"
        )
    return getattr(render_images(snapshot, camera, parent_frame, X_PC, (kind,)), kind)


def render_images(
    snapshot: Snapshot,
    camera: Any,
    parent_frame: FrameId,
    X_PC: Any,
    kinds: Iterable[ImageKind | str] | None,
) -> Images:
    """Return the images of all these kinds; None: of all that the camera makes."""
    depth_range = camera.depth_range if isinstance(camera, DepthRenderCamera) else None
    if not isinstance(camera, (ColorRenderCamera, DepthRenderCamera)):
        raise QueryArgumentError(
            "render_images: camera must be a ColorRenderCamera or a DepthRenderCamera, not"
            f" {quoted(camera)}"
        )
    wanted = _checked_kinds(kinds, depth_range is not None)
    core = camera.core
    engine: RenderEngine = find_renderer(snapshot.state.renderers, core.renderer_name)
    X_WP = snapshot.pose_in_world(snapshot.state.frame(parent_frame).id)
    X_WC = compose(X_WP, as_pose(X_PC, "X_PC of the camera"))
    return engine.render(snapshot, core, compose(X_WC, core.X_BS), wanted, depth_range)


def _checked_kinds(
    kinds: Iterable[ImageKind | str] | None, has_range: bool
) -> frozenset[ImageKind]:
    """Return the kinds that are wanted. Raises QueryArgumentError."""
    if kinds is None:
        return frozenset(k for k in ImageKind if has_range or k is not ImageKind.DEPTH)
    try:
        wanted = frozenset(ImageKind(kind) for kind in (() if isinstance(kinds, str) else kinds))
    except (TypeError, ValueError):
        wanted = frozenset()
    if not wanted:
        names = ", ".join(repr(kind.value) for kind in ImageKind)
        raise QueryArgumentError(f"kinds must be some of {names}, not {quoted(kinds)}")
    if ImageKind.DEPTH in wanted and not has_range:
        raise QueryArgumentError(
            "kinds: a depth image needs a DepthRenderCamera, which has a depth range"
        )
    return wanted
