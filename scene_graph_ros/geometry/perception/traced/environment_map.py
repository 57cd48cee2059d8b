"""Light from all around, as a picture of all directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array

__all__ = ["EnvironmentMap"]


@one_line()
@dataclass(frozen=True, eq=False)
class EnvironmentMap:
    """Radiance from all directions, and whether cameras see it behind all bodies.

    ``texture`` ``(h, w, 3)`` is linear red, green and blue, at least 0; 1 from all sides lights a
    white surface to full white. It is equirectangular: rows go from +z of W down to -z, columns
    around z to the right, as seen from within: +x, -y, -x, +y, and back to +x at the last one's
    end. Without ``skybox`` it is light alone, and pixels that see nothing have the clear colour.

    Raises EngineError for another shape, and for what is negative or not finite.
    """

    texture: NDArray[np.float64]
    skybox: bool = True

    def __post_init__(self) -> None:
        """Check and freeze the array."""
        rule = "EnvironmentMap: texture must be finite numbers (h, w, 3), at least 0"
        given = real_array(self.texture, rule, EngineError)
        if given.ndim != 3 or given.shape[2] != 3 or min(given.shape[:2]) < 2:
            raise EngineError(f"{rule}, h and w at least 2, not {given.shape}")
        if not np.isfinite(given).all() or (given < 0.0).any():
            raise EngineError(f"{rule}, not {quoted(self.texture)}")
        if not isinstance(self.skybox, bool):
            raise EngineError(
                f"EnvironmentMap: skybox must be True or False, not {quoted(self.skybox)}"
            )
        own = given.copy()
        own.setflags(write=False)
        object.__setattr__(self, "texture", own)
