"""A root of lanes."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import every, root, select

__all__ = ["inverse_root"]


@inlined_kernel
def inverse_root(square):
    """Return 1 / sqrt of lanes, 0 where they are."""
    return select(square > 0.0, 1.0 / root(square), every(0.0))
