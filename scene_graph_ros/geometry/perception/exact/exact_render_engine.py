"""The renderer that computes depth and label exactly, on the processor, without any library."""

from __future__ import annotations

from dataclasses import dataclass, field
import json

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.render_label import RenderLabel
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.perception.camera import DepthRange, RenderCameraCore
from scene_graph_ros.geometry.perception.engine import ImageKind, Images
from scene_graph_ros.geometry.perception.exact.color import color_image
from scene_graph_ros.geometry.perception.exact.image_kernels import write_depth, write_label
from scene_graph_ros.geometry.perception.exact.view import look
from scene_graph_ros.geometry.perception.exact.visibility import find_visible

__all__ = ["ExactRenderEngine"]


@dataclass(frozen=True, slots=True)
class ExactRenderEngine:
    """Depth and label of what is really there: every shape by its equation, meshes watertight.

    One pass finds what each pixel sees, for all kinds of images. Colour is Lambert's law with one
    white light along the camera's axis, without shadows. Depth and label take what is transparent
    for opaque.
    """

    default_diffuse: Rgba = field(default_factory=lambda: Rgba(0.9, 0.7, 0.2))
    """The colour of geometries that have none."""
    default_clear_color: Rgba = field(default_factory=lambda: Rgba(204 / 255, 229 / 255, 1.0))
    """The colour of pixels that see nothing."""

    def __post_init__(self) -> None:
        """Accept three or four numbers as a colour. Raises PropertyError for anything else."""
        for name in ("default_diffuse", "default_clear_color"):
            object.__setattr__(self, name, Rgba.from_value(getattr(self, name)))

    @property
    def type_name(self) -> str:
        """The name of the renderer's class."""
        return type(self).__name__

    def parameter_yaml(self) -> str:
        """Return the parameters as YAML, below the type's name."""
        colors = {
            name: getattr(self, name).as_array().tolist()
            for name in ("default_diffuse", "default_clear_color")
        }
        lines = [f"  {name}: {json.dumps(color)}\n" for name, color in colors.items()]
        return f"{self.type_name}:\n{''.join(lines)}"

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
