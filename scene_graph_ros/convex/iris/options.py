"""How regions are grown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import Any, TYPE_CHECKING

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

if TYPE_CHECKING:
    from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
    from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid

__all__ = ["IrisOptions"]


@one_line()
@dataclass(frozen=True, kw_only=True)
class IrisOptions:
    """The end of growth, and the constraints of a region.

    Raises ConvexSetError, which names the option and its value.
    """

    require_sample_point_is_contained: bool = False
    """End with the last region that has the sample inside, instead of growing away from it."""
    iteration_limit: int = 100
    """Regions that are made at most, at least 1."""
    termination_threshold: float = 2e-2
    """End where the ellipsoid's volume grows by no more, in the set's units; not if negative."""
    relative_termination_threshold: float = 1e-3
    """End where it grows by no more than this share of the best so far; not if negative."""
    bounding_region: HPolyhedron | None = None
    """What the region is kept within, besides the domain."""
    starting_ellipse: Hyperellipsoid | None = None
    """Around which the first faces are put, instead of a ball about the sample."""
    verify_domain_boundedness: bool = True
    """Refuse an unbounded domain at once; who knows that it is bounded saves that proof."""
    termination_func: Callable[[HPolyhedron], bool] | None = None
    """Asked about each new region; growing ends where it says True, with the region before. It is
    an error where it says that of the first."""

    def __post_init__(self) -> None:
        """Check all values."""
        limit: Any = self.iteration_limit
        if isinstance(limit, bool) or not isinstance(limit, int) or limit < 1:
            raise ConvexSetError(
                "IrisOptions: iteration_limit must be a whole number, at least 1, not"
                f" {quoted(limit)}"
            )
        for name in ("termination_threshold", "relative_termination_threshold"):
            value = as_float(getattr(self, name))
            if value is None or math.isnan(value):
                raise ConvexSetError(
                    f"IrisOptions: {name} must be a number, not {quoted(getattr(self, name))}"
                )
        if self.termination_func is not None and not callable(self.termination_func):
            raise ConvexSetError(
                "IrisOptions: termination_func must be callable, not"
                f" {quoted(self.termination_func)}"
            )
