"""The renderer that traces light, by way of Mitsuba, on the processor."""

from __future__ import annotations

from dataclasses import dataclass, field
import importlib.util
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.perception.camera import DepthRange, RenderCameraCore
from scene_graph_ros.geometry.perception.checked_fields import checked_number, checked_whole
from scene_graph_ros.geometry.perception.engine import ImageKind, Images
from scene_graph_ros.geometry.perception.engine_parameters import (
    CLEAR_COLOR,
    DIFFUSE,
    parameters_as_yaml,
    take_colors,
)
from scene_graph_ros.geometry.perception.exact.body_table import body_table, place_bodies
from scene_graph_ros.geometry.perception.exact.exact_render_engine import ExactRenderEngine
from scene_graph_ros.geometry.perception.srgb import srgb
from scene_graph_ros.geometry.perception.traced.environment_map import EnvironmentMap
from scene_graph_ros.geometry.perception.traced.lights import LightParameter
from scene_graph_ros.geometry.perception.traced.mitsuba_scene import trace, Tracing
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.missing_package import not_installed

__all__ = ["TracedRenderEngine"]

_MAX_LIGHTS = 64
_MAX_SEED = 2**32 - 1


def _default_lights() -> tuple[LightParameter, ...]:
    """Return one light from over the camera's left shoulder, which has shadows seen."""
    return (LightParameter(direction=(0.4, 0.6, 1.0), intensity=0.8),)


@one_line()
@dataclass(frozen=True, slots=True)
class TracedRenderEngine:
    """Colour with light and shadows, by path tracing; depth and label are those of exact's.

    Surfaces are matt. Light adds up as light does: colours are sRGB, as they stand in properties
    and in images. Round shapes are triangles, less than 1e-3 of their size off, and a transparent
    body is seen through at each of its surfaces. ``samples`` are paths per pixel; more of them
    have less noise. The same seed gives the same bytes. One image is traced at a time in a
    process, by all of its processors.

    Raises EngineError where Mitsuba is not installed and for a parameter out of range.
    """

    default_diffuse: Rgba = DIFFUSE
    """The colour of geometries that have none."""
    default_clear_color: Rgba = CLEAR_COLOR
    """The colour of pixels that see nothing."""
    lights: tuple[LightParameter, ...] = field(default_factory=_default_lights)
    ambient: float = 0.2
    """Light from all sides: 1 lights a white surface that nothing hides to full white."""
    samples: int = 16
    max_depth: int = 3
    """Surfaces and lights on a path: 2 is direct light alone."""
    seed: int = 0
    environment_map: EnvironmentMap | None = None
    """Light from all around as a picture of it, in place of ``ambient``; not for scene files."""

    def __post_init__(self) -> None:
        if importlib.util.find_spec("mitsuba") is None:
            raise EngineError(not_installed("TracedRenderEngine", "mitsuba==3.9.1"))
        if not isinstance(self.environment_map, EnvironmentMap | None):
            raise EngineError(
                "TracedRenderEngine: environment_map must be an EnvironmentMap or None, not"
                f" {quoted(self.environment_map)}"
            )
        values: dict[str, Any] = {
            "lights": self._checked_lights(),
            "ambient": checked_number(self, "ambient", 0.0, 1e6),
            "samples": checked_whole(self, "samples", 1, 2**16),
            "max_depth": checked_whole(self, "max_depth", 2, 1000),
            "seed": checked_whole(self, "seed", 0, _MAX_SEED),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)
        take_colors(self, ("default_diffuse", "default_clear_color"))

    def _checked_lights(self) -> tuple[LightParameter, ...]:
        given: Any = self.lights
        is_list = isinstance(given, (list, tuple)) and len(given) <= _MAX_LIGHTS
        if not is_list or not all(isinstance(light, LightParameter) for light in given):
            raise EngineError(
                f"TracedRenderEngine: lights must be at most {_MAX_LIGHTS} LightParameter, not"
                f" {quoted(given)}"
            )
        return tuple(given)

    @property
    def type_name(self) -> str:
        """The name of the renderer's class."""
        return type(self).__name__

    def parameter_yaml(self) -> str:
        """Return the parameters as YAML, below the type's name."""
        names = (
            "default_diffuse",
            "default_clear_color",
            "ambient",
            "samples",
            "max_depth",
            "seed",
        )
        values: dict[str, Any] = {name: getattr(self, name) for name in names}
        values["lights"] = [
            {
                "type": light.type,
                "color": light.color.as_array().tolist(),
                "intensity": light.intensity,
                "position": light.position,
                "direction": light.direction,
                "frame": light.frame,
                "cone_angle": light.cone_angle,
            }
            for light in self.lights
        ]
        if self.environment_map is not None:
            rows, columns = self.environment_map.texture.shape[:2]
            values["environment_map"] = {
                "size": [columns, rows],
                "skybox": self.environment_map.skybox,
            }
        return parameters_as_yaml(self, values)

    def render(
        self,
        snapshot: Snapshot,
        core: RenderCameraCore,
        X_WS: NDArray[np.float64],
        kinds: frozenset[ImageKind],
        depth_range: DepthRange | None,
    ) -> Images:
        """Return the images of these kinds that a sensor at ``X_WS`` sees."""
        others = kinds - {ImageKind.COLOR}
        images = Images()
        if others:
            images = ExactRenderEngine().render(snapshot, core, X_WS, others, depth_range)
        if ImageKind.COLOR not in kinds:
            return images
        red, green, blue, alpha = self.default_diffuse.as_array().tolist()
        table = body_table(snapshot.state, core.renderer_name, (red, green, blue, alpha))
        bodies, cover = place_bodies(snapshot, table)
        tracing = Tracing(
            self.lights,
            self.ambient,
            self.samples,
            self.max_depth,
            self.seed,
            self.environment_map,
        )
        light = trace(tracing, bodies, cover, core, X_WS)
        return images._replace(color=self._levels(light))

    def _levels(self, light: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the image, with the clear colour behind the traced bodies."""
        alpha = np.clip(light[..., 3:], 0.0, 1.0)
        clear = self.default_clear_color.as_array()[:3]
        is_covered = alpha > 0.0
        lit = srgb(light[..., :3] / np.where(is_covered, alpha, 1.0))
        # Edges are mixed as they are written, as in other renderers.
        mixed = alpha * lit + (1.0 - alpha) * clear
        image = np.full((*light.shape[:2], 4), 255, np.uint8)
        image[..., :3] = np.floor(255.0 * mixed + 0.5)
        return image
