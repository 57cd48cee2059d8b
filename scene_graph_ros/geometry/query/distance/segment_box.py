"""Nearest points of a segment and a box."""

from scene_graph_ros.geometry.jit import kernel

__all__ = ["excess", "nearest_on_segment_to_box"]


@kernel
def excess(value, bound):
    """Return how far a coordinate is outside [-bound, bound], signed; 0 inside."""
    return value - min(max(value, -bound), bound)


@kernel
def _slope(size, c, u, t):
    """Return half the derivative of the squared distance of c + t u to the box."""
    return (
        u[0] * excess(c[0] + t * u[0], size[0])
        + u[1] * excess(c[1] + t * u[1], size[1])
        + u[2] * excess(c[2] + t * u[2], size[2])
    )


@kernel
def nearest_on_segment_to_box(size, c, u):
    """Return t in [-1, 1] for which c + t u is nearest to the box of half extents ``size``.

    The squared distance is convex in t and quadratic between the places where a coordinate passes
    a face, so its derivative grows, linearly between these breaks. Where several t are nearest,
    the middle one is returned. A component of u that is rounding must have been made zero.
    """
    # Derivative negative at low, positive at high; zero from first to last, if anywhere.
    low, high, low_slope, high_slope = -1.0, 1.0, 0.0, 0.0
    first, last = 2.0, -2.0
    for index in range(8):
        if index < 6:
            axis = index >> 1
            if u[axis] == 0.0:
                continue
            face = size[axis] if index & 1 else -size[axis]
            t = (face - c[axis]) / u[axis]
            if not -1.0 < t < 1.0:
                continue
        else:
            t = -1.0 if index == 6 else 1.0
        slope = _slope(size, c, u, t)
        if slope < 0.0:
            if low_slope == 0.0 or t > low:
                low, low_slope = t, slope
        elif slope > 0.0:
            if high_slope == 0.0 or t < high:
                high, high_slope = t, slope
        else:
            first, last = min(first, t), max(last, t)
    if first <= last:
        return 0.5 * (first + last)
    if low_slope == 0.0:
        return -1.0
    if high_slope == 0.0:
        return 1.0
    t = low + (high - low) * (low_slope / (low_slope - high_slope))
    return min(max(t, low), high)
