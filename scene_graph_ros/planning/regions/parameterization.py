"""Functions from a region's points to configurations, with their derivatives."""

from __future__ import annotations

from collections.abc import Callable
import numbers
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.regions.errors import RegionError

__all__ = ["IrisParameterizationFunction", "checked_parameterization"]

PointFunction = Callable[[NDArray[np.float64]], ArrayLike]


@one_line("dimension", "has_jacobian")
class IrisParameterizationFunction:
    """A continuous function of a region's points that returns configurations.

    A region that grows with it is a polyhedron of these points. Obstacles and constraints are of
    configurations; the domain, the ellipsoid and the points to keep are of the region's points.
    """

    def __init__(
        self,
        function: PointFunction,
        jacobian: PointFunction | None = None,
        *,
        dimension: int | None = None,
    ) -> None:
        """Take a function of points ``(n, k)`` that returns configurations ``(n, nq)``.

        ``jacobian`` returns its derivatives ``(n, nq, k)``; `iris_in_configuration_space` needs
        them. ``dimension`` is k, that of the domain where it is not given. For the substitution by
        tangents of half angles take ``compute_q_value`` and ``compute_q_jacobian`` of
        `RationalForwardKinematics`.

        Raises RegionError for what can't be called, and for a dimension that is no whole number
        above 0.
        """
        for name, given in (("function", function), ("jacobian", jacobian)):
            if not callable(given) and (name == "function" or given is not None):
                raise RegionError(
                    f"IrisParameterizationFunction: {name} must be a function, not {quoted(given)}"
                )
        given_dimension: Any = dimension
        is_whole = isinstance(given_dimension, numbers.Integral) and given_dimension is not True
        if dimension is not None and (not is_whole or dimension < 1):
            raise RegionError(
                "IrisParameterizationFunction: dimension must be a whole number above 0, not"
                f" {quoted(dimension)}"
            )
        self.function, self.jacobian = function, jacobian
        self.dimension = None if dimension is None else int(dimension)

    @property
    def has_jacobian(self) -> bool:
        """Whether derivatives were given."""
        return self.jacobian is not None

    def __call__(self, points: NDArray[np.float64]) -> ArrayLike:
        """Return what the function returns of points ``(n, k)``."""
        return self.function(points)

    def configurations(self, points: NDArray[np.float64], nq: int) -> NDArray[np.float64]:
        """Return configurations ``(n, nq)`` of points ``(n, k)``.

        Raises RegionError for a function that returns something else.
        """
        return _checked("parameterization", self.function, points, (len(points), nq))

    def derivatives(self, points: NDArray[np.float64], nq: int) -> NDArray[np.float64]:
        """Return derivatives ``(n, nq, k)`` at points ``(n, k)``. Raises as above."""
        assert self.jacobian is not None
        name = "the parameterization's jacobian"
        return _checked(name, self.jacobian, points, (len(points), nq, points.shape[1]))


def checked_parameterization(given: Any, where: str) -> IrisParameterizationFunction | None:
    """Return a parameterization, also of a plain function; None stays. Raises RegionError."""
    if given is None or isinstance(given, IrisParameterizationFunction):
        return given
    if not callable(given):
        raise RegionError(
            f"{where}: parameterization must be a function, or None, not {quoted(given)}"
        )
    return IrisParameterizationFunction(given)


def _checked(
    name: str, function: PointFunction, points: NDArray[np.float64], shape: tuple[int, ...]
) -> NDArray[np.float64]:
    given = function(points.copy())  # which it may write into
    rule = f"{name} must return finite numbers"
    result = real_array(given, rule, RegionError)
    if result.shape != shape or not np.isfinite(result).all():
        raise RegionError(f"{rule} {shape} of points {points.shape}, not {quoted(given)}")
    return result
