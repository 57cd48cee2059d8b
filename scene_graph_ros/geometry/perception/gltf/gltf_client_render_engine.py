"""The renderer that has a server render, by the protocol of Drake's glTF client."""

from __future__ import annotations

from dataclasses import dataclass
import importlib.util
import logging
import math
from pathlib import Path
import tempfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.perception.camera import DepthRange, RenderCameraCore
from scene_graph_ros.geometry.perception.checked_fields import checked_number
from scene_graph_ros.geometry.perception.engine import ImageKind, Images
from scene_graph_ros.geometry.perception.engine_parameters import (
    DIFFUSE,
    parameters_as_yaml,
    take_colors,
)
from scene_graph_ros.geometry.perception.exact.body_table import body_table, place_bodies
from scene_graph_ros.geometry.perception.gltf.answers import color_of, depth_of, label_of
from scene_graph_ros.geometry.perception.gltf.document import gltf_document
from scene_graph_ros.geometry.perception.gltf.exchange import checked_url, post
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.missing_package import not_installed

__all__ = ["GltfClientRenderEngine"]

_BYTES_PER_PIXEL = 16
_MORE_BYTES = 2**20

_log = logging.getLogger(__name__)


@one_line()
@dataclass(frozen=True, slots=True)
class GltfClientRenderEngine:
    """Images by a server: each kind is a POST of the scene as glTF and of the camera as a form.

    The server answers with an image of the camera's size: PNG for colour and label, TIFF for
    depth. Shapes that it does not know are refused by name, and so is an answer that is late, too
    large or no such image: EngineError then, with the address. Nothing is asked before an image
    is. docs/cameras.md has the form's fields.
    """

    base_url: str = "http://127.0.0.1:8000"
    render_endpoint: str = "render"
    verbose: bool = False
    """Whether each question and its answer are logged."""
    cleanup: bool = True
    """Whether nothing stays of them; else they are written into a folder, which is logged."""
    timeout: float = 60.0
    """Seconds for one image, from the connection to the last byte."""
    default_diffuse: Rgba = DIFFUSE
    """The colour of geometries that have none."""

    def __post_init__(self) -> None:
        """Raise EngineError for a bad parameter, and where Pillow, which reads answers, is not."""
        checked_url(self.base_url, self.render_endpoint)
        for name in ("verbose", "cleanup"):
            if not isinstance(getattr(self, name), bool):
                raise EngineError(
                    f"GltfClientRenderEngine: {name} must be True or False, not"
                    f" {quoted(getattr(self, name))}"
                )
        object.__setattr__(self, "timeout", checked_number(self, "timeout", 1e-3, 3600.0))
        take_colors(self, ("default_diffuse",))
        if importlib.util.find_spec("PIL") is None:
            raise EngineError(not_installed("GltfClientRenderEngine", "pillow"))

    @property
    def type_name(self) -> str:
        """The name of the renderer's class."""
        return type(self).__name__

    def parameter_yaml(self) -> str:
        """Return the parameters as YAML, below the type's name."""
        names = (
            "base_url", "render_endpoint", "verbose", "cleanup", "timeout", "default_diffuse",
        )  # fmt: skip
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
        table = body_table(snapshot.state, core.renderer_name, (red, green, blue, alpha))
        (bodies, cover), lens = place_bodies(snapshot, table), core.intrinsics
        found: dict[str, Any] = {}
        for kind in sorted(kinds):
            by_label = kind is ImageKind.LABEL
            scene = gltf_document(bodies, cover, core, X_WS, by_label=by_label)
            answer = self._ask(kind, scene, _fields(kind, core, depth_range))
            try:
                if kind is ImageKind.DEPTH:
                    assert depth_range is not None  # the query layer checked it
                    found[kind.value] = depth_of(answer, lens, depth_range)
                else:
                    read = label_of if by_label else color_of
                    found[kind.value] = read(answer, lens)
            except EngineError as error:
                raise EngineError(f"render server {self._url()}: {kind.value}: {error}") from error
        return Images(**found)

    def _url(self) -> str:
        return checked_url(self.base_url, self.render_endpoint).geturl()

    def _ask(self, kind: ImageKind, scene: bytes, fields: dict[str, str]) -> bytes:
        if self.verbose:
            _log.info("%s: %s of %d bytes of glTF", self._url(), kind.value, len(scene))
        limit = _MORE_BYTES + _BYTES_PER_PIXEL * int(fields["width"]) * int(fields["height"])
        url = checked_url(self.base_url, self.render_endpoint)
        folder = None
        if not self.cleanup:
            folder = Path(tempfile.mkdtemp(prefix="scene_graph_ros_gltf_"))
            (folder / "scene.gltf").write_bytes(scene)
            _log.info("%s: question and answer are kept in %s", self._url(), folder)
        answer = post(url, fields, scene, self.timeout, limit)
        if folder is not None:
            suffix = "tiff" if kind is ImageKind.DEPTH else "png"
            (folder / f"{kind.value}.{suffix}").write_bytes(answer)
        if self.verbose:
            _log.info("%s: answered with %d bytes", self._url(), len(answer))
        return answer


def _fields(
    kind: ImageKind, core: RenderCameraCore, depth_range: DepthRange | None
) -> dict[str, str]:
    """Return the form's fields beside the scene. Pixels' centres are at halves, as in glTF."""
    lens, clipping = core.intrinsics, core.clipping
    fields: dict[str, Any] = {
        "image_type": kind.value,
        "width": lens.width,
        "height": lens.height,
        "near": clipping.near,
        "far": clipping.far,
        "focal_x": lens.fx,
        "focal_y": lens.fy,
        "fov_x": 2.0 * math.atan(0.5 * lens.width / lens.fx),
        "fov_y": 2.0 * math.atan(0.5 * lens.height / lens.fy),
        "center_x": lens.cx + 0.5,
        "center_y": lens.cy + 0.5,
    }
    if kind is ImageKind.DEPTH and depth_range is not None:
        fields |= {"min_depth": depth_range.min_depth, "max_depth": depth_range.max_depth}
    return {name: repr(value) for name, value in fields.items() if name != "image_type"} | {
        "image_type": kind.value
    }
