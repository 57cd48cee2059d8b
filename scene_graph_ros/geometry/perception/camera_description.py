"""A camera by names: its frame, its images and their rate."""

from __future__ import annotations

from dataclasses import dataclass
import enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.perception.camera import DepthRenderCamera
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.spatial.poses import as_pose

__all__ = ["MAX_RATE", "CameraDescription", "CameraOutput"]

MAX_RATE = 1000.0
"""Hz, of a camera."""

_MIN_RATE = 1e-3


class CameraOutput(enum.StrEnum):
    """An output of a camera. Each is a string: ``"depth"`` may stand for ``DEPTH``."""

    COLOR = "color"
    DEPTH = "depth"
    LABEL = "label"
    POINTS = "points"
    """What each pixel sees as a point with its colour and label."""


@one_line()
@dataclass(frozen=True, slots=True, eq=False)
class CameraDescription:
    """A camera of a scene.

    ``frame`` is a frame of ``source``, or "world". ``X_PC`` ``(4, 4)`` is the pose in it of the
    camera, whose axes are those of the sensor: x right, y down, z ahead. It offers ``outputs`` at
    most ``rate`` times per second.

    Raises InvalidNameError for a name that ``canonical_name`` refuses, QueryArgumentError for no
    outputs or unknown ones and for a rate that is no number from 0.001 to MAX_RATE, and
    InvalidPoseError for a pose that is not rigid and finite.
    """

    name: str
    source: str
    frame: str
    X_PC: NDArray[np.float64]
    camera: DepthRenderCamera
    outputs: frozenset[CameraOutput] = frozenset(set(CameraOutput) - {CameraOutput.POINTS})
    rate: float = 30.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", canonical_name("camera", self.name))
        if not isinstance(self.camera, DepthRenderCamera):
            raise QueryArgumentError(
                f"camera {self.name!r}: camera must be a DepthRenderCamera, not"
                f" {quoted(self.camera)}"
            )
        values = {
            "X_PC": as_pose(self.X_PC, f"X_PC of camera {self.name!r}"),
            "outputs": self._checked_outputs(self.outputs),
            "rate": self._checked_rate(self.rate),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _checked_outputs(self, outputs: Any) -> frozenset[CameraOutput]:
        try:
            wanted = frozenset(map(CameraOutput, () if isinstance(outputs, str) else outputs))
        except (TypeError, ValueError):
            wanted = frozenset()
        if not wanted:
            names = ", ".join(repr(output.value) for output in CameraOutput)
            raise QueryArgumentError(
                f"camera {self.name!r}: outputs must be some of {names}, not {quoted(outputs)}"
            )
        return wanted

    def _checked_rate(self, rate: Any) -> float:
        number = as_float(rate)
        if number is None or not _MIN_RATE <= number <= MAX_RATE:
            raise QueryArgumentError(
                f"camera {self.name!r}: rate must be a number from {_MIN_RATE:g} to"
                f" {MAX_RATE:g}, not {quoted(rate)}"
            )
        return number
