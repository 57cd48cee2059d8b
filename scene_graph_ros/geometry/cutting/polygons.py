"""Memory for the polygons that are cut."""

from scene_graph_ros.geometry.compiled.stack_arrays import stack_array

__all__ = ["POLYGON_CORNERS", "polygon_buffer"]

POLYGON_CORNERS = 8
"""A quadrilateral cut by a quadrilateral has no more corners."""

polygon_buffer = stack_array((2, POLYGON_CORNERS, 3))
"""Return an uninitialized array of ``(2, POLYGON_CORNERS, 3)`` float64."""
