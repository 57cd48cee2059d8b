"""Images of depth as points with radii: projection, self filter, clearing, decay. No ROS here.

`DepthView` is one image at a pose, `SelfFilter` marks the pixels that show a robot or its load,
and `SeenPoints` remembers the points of earlier images until a later one sees through them.
"""

from scene_graph_ros.sensing.depth_view import DepthRules, DepthView, NewPoints
from scene_graph_ros.sensing.seen_points import Counts, SeenPoints
from scene_graph_ros.sensing.self_filter import Body, SelfFilter

__all__ = ["Body", "Counts", "DepthRules", "DepthView", "NewPoints", "SeenPoints", "SelfFilter"]
