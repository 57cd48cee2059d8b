"""Images of cameras, as queries about a snapshot; imported and computed when they are asked."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.on_demand import on_demand

if TYPE_CHECKING:
    from scene_graph_ros.geometry.perception import (
        ColorRenderCamera,
        DepthRenderCamera,
        ImageKind,
        Images,
        RenderEngine,
    )

__all__ = ["RenderQueries"]


class RenderQueries:
    """The part of a QueryObject that is about cameras.

    A camera C is posed on a frame P, by ``X_PC`` ``(4, 4)``; see ``geometry.perception``.
    """

    @property
    def snapshot(self) -> Snapshot:
        """The moment that is asked about."""
        raise NotImplementedError

    def render_color_image(
        self, camera: ColorRenderCamera, parent_frame: FrameId, X_PC: ArrayLike
    ) -> NDArray[np.uint8]:
        """Return a colour image ``(height, width, 4)``: red, green, blue, alpha.

        Raises:
            QueryArgumentError: ``camera`` is not for this kind of image.
            EngineError: there is no renderer of the name that the camera gives.
            UnknownIdError, InvalidPoseError: there is no such frame, or ``X_PC`` is no pose.

        """
        return on_demand("render_one")(self.snapshot, "color", camera, parent_frame, X_PC)

    def render_depth_image(
        self, camera: DepthRenderCamera, parent_frame: FrameId, X_PC: ArrayLike
    ) -> NDArray[np.float32]:
        """Return a depth image ``(height, width)``, in m; raises as ``render_color_image``.

        Depth is along the camera's axis; 0 nearer than the depth range, inf beyond it and where
        nothing is.
        """
        return on_demand("render_one")(self.snapshot, "depth", camera, parent_frame, X_PC)

    def render_label_image(
        self, camera: ColorRenderCamera, parent_frame: FrameId, X_PC: ArrayLike
    ) -> NDArray[np.int16]:
        """Return a label image ``(height, width)``; raises as ``render_color_image``."""
        return on_demand("render_one")(self.snapshot, "label", camera, parent_frame, X_PC)

    def render_images(
        self,
        camera: ColorRenderCamera | DepthRenderCamera,
        parent_frame: FrameId,
        X_PC: ArrayLike,
        *,
        kinds: Iterable[ImageKind | str] | None = None,
    ) -> Images:
        """Return images of all these kinds, found in one pass: they agree on visible bodies.

        Without ``kinds``, colour and label, and depth if the camera has a depth range. Raises as
        ``render_color_image``, and QueryArgumentError for kinds there are not.
        """
        render = on_demand("render_images")
        return render(self.snapshot, camera, parent_frame, X_PC, kinds)

    def get_render_engine_by_name(self, name: Any) -> RenderEngine | None:
        """Return the renderer of a name, or None. It shows any snapshots that it is given."""
        return self.snapshot.state.renderers.get(name) if isinstance(name, str) else None
