"""How a collision checker measures configurations, and the ways between them."""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.distance_and_interpolation import (
    ConfigurationDistanceFunction,
    ConfigurationInterpolationFunction,
    DistanceAndInterpolationProvider,
    FunctionsProvider,
    LinearDistanceAndInterpolationProvider,
)
from scene_graph_ros.planning.errors import CollisionCheckerError, finite_number
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["MAX_PIECES", "ConfigurationWays"]

MAX_PIECES = 1_000_000
"""Of one way; more would need gigabytes."""


class ConfigurationWays:
    """The provider of a checker, and ways between configurations.

    A provider is put in place at once; checks that have begun keep their own.
    """

    def __init__(
        self,
        tree: KinematicTree,
        *,
        edge_step_size: float,
        distance_and_interpolation_provider: DistanceAndInterpolationProvider | None,
        configuration_distance_function: ConfigurationDistanceFunction | None,
    ) -> None:
        self._tree = tree
        linear = LinearDistanceAndInterpolationProvider(tree)
        provider: DistanceAndInterpolationProvider = linear
        if configuration_distance_function is not None:
            if distance_and_interpolation_provider is not None:
                raise CollisionCheckerError(
                    "only one of distance_and_interpolation_provider and"
                    " configuration_distance_function may be given"
                )
            function = _callable(
                "configuration_distance_function", configuration_distance_function
            )
            provider = FunctionsProvider(linear, function)
        elif distance_and_interpolation_provider is not None:
            provider = _provider(distance_and_interpolation_provider)
        self.provider = provider
        self._lock = threading.RLock()
        self.set_edge_step_size(edge_step_size)

    def set_edge_step_size(self, edge_step_size: float) -> None:
        """Set it. Raises CollisionCheckerError where it is not positive."""
        number = finite_number("edge_step_size", edge_step_size)
        if number <= 0.0:
            raise CollisionCheckerError(
                f"edge_step_size must be positive, not {quoted(edge_step_size)}"
            )
        self.edge_step_size = number

    def set_distance_and_interpolation_provider(
        self, provider: DistanceAndInterpolationProvider
    ) -> None:
        """Use another provider. Functions that were set are used no more."""
        checked = _provider(provider)
        with self._lock:
            self.provider = checked

    def set_configuration_distance_function(
        self, distance_function: ConfigurationDistanceFunction
    ) -> None:
        """Use another function ``(q1, q2)``. Raises CollisionCheckerError as said below.

        That is for an object that cannot be called, for this checker's own distance, and where a
        provider is in use: the checker must have been made with a
        ``configuration_distance_function``.
        """
        self._not_own("distance_function", distance_function)
        function = _callable("distance_function", distance_function)
        with self._lock:
            self.provider = self._functions().with_distance(function)

    def set_configuration_interpolation_function(
        self, interpolation_function: ConfigurationInterpolationFunction | None
    ) -> None:
        """Use another function ``(q1, q2, ratio)``, or the linear one for None; raises alike."""
        if interpolation_function is not None:
            self._not_own("interpolation_function", interpolation_function)
            _callable("interpolation_function", interpolation_function)
        with self._lock:
            self.provider = self._functions().with_interpolation(interpolation_function)

    def compute_configuration_distance(self, q1: ArrayLike, q2: ArrayLike) -> float:
        """Return the provider's distance from q1 to q2 ``(nq,)``."""
        return self.provider.compute_configuration_distance(q1, q2)

    def interpolate_between_configurations(
        self, q1: ArrayLike, q2: ArrayLike, ratio: float
    ) -> NDArray[np.float64]:
        """Return the provider's configuration ``(nq,)`` at a ratio, 0 to 1, of the way to q2."""
        return self.provider.interpolate_between_configurations(q1, q2, ratio)

    @property
    def is_straight(self) -> bool:
        """Whether ways are straight edges."""
        provider = self.provider
        if isinstance(provider, FunctionsProvider):
            return provider.interpolation_function is None
        # A class derived from it may have ways of its own.
        return type(provider) is LinearDistanceAndInterpolationProvider

    def distances(self, edges: NDArray[np.float64]) -> list[float]:
        """Return the distances of the ends of edges ``(n, m, nq)``; Euclidean of curves."""
        provider, first, last = self.provider, edges[:, 0], edges[:, -1]
        if edges.shape[1] > 2:
            return np.linalg.norm(last - first, axis=1).tolist()
        if type(provider) is LinearDistanceAndInterpolationProvider:
            return provider.distances(first, last).tolist()
        pairs = zip(first, last, strict=True)
        return [provider.compute_configuration_distance(q1, q2) for q1, q2 in pairs]

    def way(self, q1: ArrayLike, q2: ArrayLike) -> NDArray[np.float64]:
        """Return configurations ``(n + 1, nq)`` whose straight edges are the provider's way.

        A straight way is one edge, others are those between `samples`.
        """
        return self._along(q1, q2, 1) if self.is_straight else self.samples(q1, q2)

    def samples(self, q1: ArrayLike, q2: ArrayLike) -> NDArray[np.float64]:
        """Return configurations ``(n + 1, nq)`` on the provider's way, q1 and q2 included.

        They are at equal ratios, as many as make steps of at most ``edge_step_size`` where the
        distance is uniform. Raises CollisionCheckerError for more than `MAX_PIECES` steps, and
        the errors of a provider of your own.
        """
        distance = self.provider.compute_configuration_distance(q1, q2)
        steps = max(1.0, np.ceil(distance / self.edge_step_size))
        if steps > MAX_PIECES:
            raise CollisionCheckerError(
                f"a way of {distance:g} has more than {MAX_PIECES} pieces of edge_step_size"
                f" {self.edge_step_size:g}"
            )
        return self._along(q1, q2, int(steps))

    def samples_of(self, edges: ArrayLike) -> list[NDArray[np.float64]]:
        """Return `samples` of each edge ``(n, 2, nq)``.

        Raises CollisionCheckerError for another shape.
        """
        ends = real_array(edges, "edges must be numbers", CollisionCheckerError)
        nq = self._tree.num_positions
        if ends.ndim != 3 or ends.shape[1:] != (2, nq):
            raise CollisionCheckerError(f"edges must have shape (n, 2, {nq}), not {ends.shape}")
        return [self.samples(q1, q2) for q1, q2 in ends]

    def _not_own(self, name: str, function: Any) -> None:
        """Raise CollisionCheckerError for a method of the checker that this is a part of."""
        owner = getattr(function, "__self__", None)
        if any(part is self for part in getattr(owner, "__dict__", {}).values()):
            raise CollisionCheckerError(f"{name} is this checker's own, and would ask itself")

    def _along(self, q1: ArrayLike, q2: ArrayLike, steps: int) -> NDArray[np.float64]:
        between = self.provider.interpolate_between_configurations
        return np.stack([between(q1, q2, row / steps) for row in range(steps + 1)])

    def _functions(self) -> FunctionsProvider:
        provider = self.provider
        if not isinstance(provider, FunctionsProvider):
            raise CollisionCheckerError(
                f"a {type(provider).__name__} is in use: functions are for checkers that were made"
                " with a configuration_distance_function"
            )
        return provider


def _callable(name: str, function: Any) -> Callable[..., Any]:
    if not callable(function):
        raise CollisionCheckerError(f"{name} must be a function, not {quoted(function)}")
    result: Callable[..., Any] = function
    return result


def _provider(provider: Any) -> DistanceAndInterpolationProvider:
    if not isinstance(provider, DistanceAndInterpolationProvider):
        raise CollisionCheckerError(
            "distance_and_interpolation_provider must be a DistanceAndInterpolationProvider, not"
            f" {quoted(provider)}"
        )
    return provider
