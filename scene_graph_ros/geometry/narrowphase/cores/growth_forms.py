"""The parts of the growth of cores: see `narrowphase.prove.growth`."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["NOTHING", "along"]


NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""No growth is known: that is right for every point of a core."""


@lean_kernel
def along(strength, x, y):
    """Return (tt, tu, uu) of a strength times the square of a vector with coordinates x, y."""
    return strength * x * x, strength * x * y, strength * y * y
