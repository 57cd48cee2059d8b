"""The interface of a renderer: its questions and answers."""

from __future__ import annotations

import enum
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.perception.camera import DepthRange, RenderCameraCore

__all__ = ["ImageKind", "Images", "RenderEngine"]


class ImageKind(enum.StrEnum):
    """The kind of an image. Each is a string, so that ``"depth"`` may be written for ``DEPTH``."""

    COLOR = "color"
    DEPTH = "depth"
    LABEL = "label"


@one_line()
class Images(NamedTuple):
    """Images of one moment, row by row from above; None where a kind was not asked for."""

    color: NDArray[np.uint8] | None = None
    """(height, width, 4) red, green, blue, alpha."""
    depth: NDArray[np.float32] | None = None
    """(height, width) metres along the camera's axis; 0 nearer than the depth range, inf beyond
    it and where nothing is."""
    label: NDArray[np.int16] | None = None
    """(height, width) values of RenderLabel."""


class RenderEngine(Protocol):
    """A renderer: a value that never changes. It sees snapshots, so any thread may ask it."""

    @property
    def type_name(self) -> str:
        """The name of the renderer's class."""
        ...

    def parameter_yaml(self) -> str:
        """Return the parameters as YAML, below ``type_name``."""
        ...

    def render(
        self,
        snapshot: Snapshot,
        core: RenderCameraCore,
        X_WS: NDArray[np.float64],
        kinds: frozenset[ImageKind],
        depth_range: DepthRange | None,
    ) -> Images:
        """Return the images of these kinds that a sensor at ``X_WS`` ``(4, 4)`` sees.

        S has z ahead and y down. Drawn are the geometries whose appearance accepts
        ``core.renderer_name``. There is a ``depth_range`` if depth is asked for.
        """
        ...
