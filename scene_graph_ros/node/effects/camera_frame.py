"""A camera's images of one moment: rendered and turned into messages when first asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.perception import CameraDescription, ImageKind, Images
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["CameraFrame", "optical_frame", "parent_of"]


def optical_frame(camera: CameraDescription) -> str:
    """Return the name of a camera's optical frame, as REP-103 wants it."""
    return f"{camera.name}_optical_frame"


def parent_of(camera: CameraDescription, snapshot: WorldSnapshot) -> Any:
    """Return the frame that a camera is on; raises UnknownIdError where it is gone."""
    if camera.frame == "world":
        return snapshot.inspector.world_frame_id()
    return snapshot.names.frame_id(camera.frame, camera.source)


class CameraFrame:
    """One snapshot and its images, each rendered once."""

    def __init__(self, camera: CameraDescription, snapshot: WorldSnapshot) -> None:
        """Place the camera; raises UnknownIdError where its frame is gone."""
        self._camera, self.snapshot = camera, snapshot
        self._parent = parent_of(camera, snapshot)
        self.images = Images()
        self._messages: dict[str, Any] = {}

    @property
    def X_WC(self) -> NDArray[np.float64]:
        """Pose ``(4, 4)`` of the optical frame in the world."""
        X_WP: NDArray[np.float64] = self.snapshot.query.snapshot.pose_in_world(self._parent)
        return product(X_WP, self._camera.X_PC)

    def render(self, kinds: frozenset[ImageKind]) -> frozenset[ImageKind]:
        """Have images of these kinds; return those that were not there yet."""
        missing = frozenset(k for k in kinds if getattr(self.images, k.value) is None)
        if missing:
            images = self.snapshot.query.render_images(
                self._camera.camera, self._parent, self._camera.X_PC, kinds=missing
            )
            new = {kind.value: getattr(images, kind.value) for kind in missing}
            self.images = self.images._replace(**new)
        return missing

    def message(self, topic: str, make: Callable[[CameraFrame], Any]) -> Any:
        """Return the message of a topic, made by ``make`` when it is first asked for."""
        if topic not in self._messages:
            self._messages[topic] = make(self)
        return self._messages[topic]
