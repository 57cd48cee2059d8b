"""The largest ball inside of a core that touches its surface at a known point.

Where A and B overlap by the depth d along n, the balls in A and B that touch the surfaces at the
two witnesses have their centres on one line. With radii r and s, the Minkowski difference
C = {a - b} contains a ball of radius r + s around a point r + s - d from the origin; so no
direction offers a way out shorter than d as soon as r + s >= d. That proves a depth to be the
least of all, with no search for others.
"""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.questions import placed_inner_radius
from scene_graph_ros.geometry.narrowphase.pair import body_A, body_B
from scene_graph_ros.geometry.spatial.vectors import scale
from scene_graph_ros.geometry.tolerances import INNER_BALL_SPARE

__all__ = ["is_least_depth"]


@lean_kernel
def is_least_depth(pair, a, b, n, depth, size):
    """Tell whether inner balls prove that no direction but n has a depth as small.

    a, b, n, depth: witnesses and unit normal out of B into A of cores that overlap (m).
    """
    hulls = pair.hulls
    needed = depth + INNER_BALL_SPARE * size
    found = placed_inner_radius(body_A(pair), hulls, a, scale(-1.0, n))
    return found > needed or found + placed_inner_radius(body_B(pair), hulls, b, n) > needed
