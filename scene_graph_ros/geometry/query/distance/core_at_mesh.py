"""A core beside a mesh that is measured by its triangles: the values its functions hand around."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.tables.table_arrays import Surfaces

__all__ = ["CoreAtMesh", "without_radius"]


class CoreAtMesh(NamedTuple):
    """A core K at the pose (R, p) in the frame of a mesh M; see ``cores.kinds`` for cores."""

    surfaces: Surfaces
    surface: int
    """M's row."""
    hull: Any
    """M's convex hull, as a core."""
    core: Any
    R: Any
    p: tuple[float, float, float]
    """Metres."""
    hulls: NDArray[np.float64]
    """The blocks of all hulls."""


@inlined_kernel
def without_radius(at):
    """Return the same with a core without its radius."""
    core = (at.core[0], at.core[1], 0.0, at.core[3])
    return CoreAtMesh(at.surfaces, at.surface, at.hull, core, at.R, at.p, at.hulls)
