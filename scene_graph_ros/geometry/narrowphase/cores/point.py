"""A point."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import every

__all__ = ["lane_support", "support"]


@inlined_kernel
def support(params):
    """Return (point, index): the point."""
    return (params[0], params[1], params[2]), 0


@inlined_kernel
def lane_support(params):
    """Return the point, whatever the directions."""
    return every(params[0]), every(params[1]), every(params[2])
