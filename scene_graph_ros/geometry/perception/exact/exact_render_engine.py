"""The renderer that computes depth and label exactly, on the processor, without any library."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.render_label import RenderLabel
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.perception.camera import DepthRange, RenderCameraCore
from scene_graph_ros.geometry.perception.engine import ImageKind, Images
from scene_graph_ros.geometry.perception.engine_parameters import (
    CLEAR_COLOR,
    DIFFUSE,
    parameters_as_yaml,
    take_colors,
)
from scene_graph_ros.geometry.perception.exact.color import color_image
from scene_graph_ros.geometry.perception.exact.image_kernels import write_depth, write_label
from scene_graph_ros.geometry.perception.exact.view import look
from scene_graph_ros.geometry.perception.exact.visibility import find_visible

__all__ = ["ExactRenderEngine"]


@one_line()
@dataclass(frozen=True, slots=True)
class ExactRenderEngine:
    """Depth and label of the true shapes: every shape by its equation, meshes watertight.

    One pass finds the body of each pixel, for all kinds of images. Colour is Lambert's law with
    one white light along the camera's axis, without shadows. Depth and label take transparent
    bodies for opaque.
    """

    default_diffuse: Rgba = DIFFUSE
    """The colour of geometries that have none."""
    default_clear_color: Rgba = CLEAR_COLOR
    """The colour of pixels that see nothing."""

    def __post_init__(self) -> None:
        """Accept three or four numbers as a colour. Raises PropertyError for anything else."""
        take_colors(self, ("default_diffuse", "default_clear_color"))

    @property
    def type_name(self) -> str:
        """The name of the renderer's class."""
        return type(self).__name__

    def parameter_yaml(self) -> str:
        """Return the parameters as YAML, below the type's name."""
        names = ("default_diffuse", "default_clear_color")
        return parameters_as_yaml(self, {name: getattr(self, name) for name in names})

    def render(
        self,
        snapshot: Snapshot,
        core: RenderCameraCore,
        X_WS: NDArray[np.float64],
        kinds: frozenset[ImageKind],
        depth_range: DepthRange | None,
    ) -> Images:
        """Return the images of these kinds that a sensor at ``X_WS`` sees."""
        red, green, blue, alpha = self.default_diffuse.as_array().tolist()
        view = look(snapshot, core, X_WS, (red, green, blue, alpha))
        sensor, bodies, screen = view.sensor, view.bodies, view.screen
        shape = (core.intrinsics.height, core.intrinsics.width)
        is_labelled = bodies.label != int(RenderLabel.DO_NOT_RENDER)
        color, depth, label = None, None, None
        if ImageKind.COLOR in kinds:
            color = color_image(view, self._background())
        if ImageKind.DEPTH in kinds:
            assert depth_range is not None  # the query layer checked it
            depth = np.empty(shape, np.float32)
            write_depth(screen, depth_range.min_depth, depth_range.max_depth, depth)
        if ImageKind.LABEL in kinds:
            if not is_labelled.all():
                find_visible(sensor, bodies, is_labelled, screen, view.corners)
            label = np.empty(shape, np.int16)
            write_label(screen, bodies, np.int16(RenderLabel.EMPTY), label)
        return Images(color, depth, label)

    def _background(self) -> tuple[int, int, int]:
        red, green, blue = (int(255.0 * c + 0.5) for c in self.default_clear_color.as_array()[:3])
        return red, green, blue
