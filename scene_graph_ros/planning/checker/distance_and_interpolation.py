"""How far configurations are from each other, and which are in between."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.spatial.elementary import arc_sines
from scene_graph_ros.planning.errors import CollisionCheckerError
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING

__all__ = [
    "ConfigurationDistanceFunction",
    "ConfigurationInterpolationFunction",
    "DistanceAndInterpolationProvider",
    "FunctionsProvider",
    "LinearDistanceAndInterpolationProvider",
]

ConfigurationDistanceFunction = Callable[[NDArray[np.float64], NDArray[np.float64]], float]
ConfigurationInterpolationFunction = Callable[
    [NDArray[np.float64], NDArray[np.float64], float], ArrayLike
]


@one_line()
class DistanceAndInterpolationProvider(ABC):
    """Measures configurations ``(nq,)`` and finds those in between; derive from it for your own.

    The distance of a configuration from itself must be 0. At ratio 0 there must be the first one,
    at 1 the second, and between two equal ones only these. A hook's answer is checked; an error
    that it raises goes to the caller, and changes nothing.
    """

    def compute_configuration_distance(self, q1: ArrayLike, q2: ArrayLike) -> float:
        """Return the distance from q1 to q2 ``(nq,)``, which is not negative.

        Raises CollisionCheckerError for configurations that are not finite or not alike in shape,
        and for a value that is no distance.
        """
        found = self._do_compute_configuration_distance(*_alike(q1, q2))
        distance = as_float(found)
        if distance is None or not 0.0 <= distance < math.inf:
            raise CollisionCheckerError(
                f"the configuration distance must be finite and not negative, not {quoted(found)}"
            )
        return distance

    def interpolate_between_configurations(
        self, q1: ArrayLike, q2: ArrayLike, ratio: float
    ) -> NDArray[np.float64]:
        """Return the configuration ``(nq,)`` at a ratio from 0 to 1 of the way from q1 to q2.

        Raises CollisionCheckerError for another ratio, configurations that are not finite or not
        alike in shape, and for an answer that is no configuration.
        """
        first, second = _alike(q1, q2)
        part = as_float(ratio)
        if part is None or not 0.0 <= part <= 1.0:
            raise CollisionCheckerError(f"ratio must be from 0 to 1, not {quoted(ratio)}")
        found = self._do_interpolate_between_configurations(first, second, part)
        q = _configuration("the interpolated configuration", found)
        if q.shape != first.shape:
            raise CollisionCheckerError(
                f"the interpolated configuration must have shape {first.shape}, not {q.shape}"
            )
        return q

    @abstractmethod
    def _do_compute_configuration_distance(
        self, q1: NDArray[np.float64], q2: NDArray[np.float64]
    ) -> float:
        """Return the distance of two configurations that are alike in shape and finite."""

    @abstractmethod
    def _do_interpolate_between_configurations(
        self, q1: NDArray[np.float64], q2: NDArray[np.float64], ratio: float
    ) -> ArrayLike:
        """Return the configuration at ``ratio``, which is from 0 to 1."""


@one_line("distance_weights")
class LinearDistanceAndInterpolationProvider(DistanceAndInterpolationProvider):
    """Weighted Euclidean distances, and straight ways.

    Of floating joints the distance has the angle (rad) between both orientations, and they turn
    the short way at one speed. Joints that turn without limits go as the numbers say, not the
    short way round.
    """

    def __init__(
        self,
        tree: KinematicTree,
        distance_weights: ArrayLike | Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Take weights of all positions ``(nq,)``, or those of some joints by name.

        Without, they are 1. Of a quaternion's four the first is the angle's, the others are 0. A
        joint's own are a number, or one for each of its positions. Raises CollisionCheckerError
        naming the joint or position and the weight, and where there is no such joint.
        """
        self._tree = tree
        starts = tree.table.starts[1:].tolist()
        own = [(j, s) for j, s in zip(tree.joints, starts, strict=True) if not j.mimics]
        ends = [*(start for _, start in own), tree.num_positions][1:]
        self._parts = {
            joint.name: slice(start, end) for (joint, start), end in zip(own, ends, strict=True)
        }
        self._quaternions = tuple(start for joint, start in own if joint.kind == FLOATING)
        weights = self._default()
        if isinstance(distance_weights, Mapping):
            for name, values in distance_weights.items():
                self._set_joint(weights, name, values)
        elif distance_weights is not None:
            given = _configuration("distance_weights", distance_weights)
            if given.shape != weights.shape:
                raise CollisionCheckerError(
                    f"distance_weights must have shape {weights.shape}, not {given.shape}"
                )
            weights = given.copy()
        self._check(weights)
        weights.setflags(write=False)
        self._weights = weights

    @property
    def distance_weights(self) -> NDArray[np.float64]:
        """``(nq,)``."""
        return self._weights

    @property
    def quaternion_dof_start_indices(self) -> tuple[int, ...]:
        """Where the four positions of each quaternion begin."""
        return self._quaternions

    def distances(self, q1: NDArray[np.float64], q2: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances ``(n,)`` of many configurations ``(n, nq)`` of the tree."""
        ways = q2 - q1
        for start in self._quaternions:
            a, b = (_units(q[:, start : start + 4]) for q in (q1, q2))
            chords = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
            ways[:, start] = 4.0 * arc_sines(np.minimum(1.0, 0.5 * chords))
        result: NDArray[np.float64] = np.linalg.norm(ways * self._weights, axis=1)
        return result

    def _default(self) -> NDArray[np.float64]:
        weights = np.ones(self._tree.num_positions)
        for start in self._quaternions:
            weights[start + 1 : start + 4] = 0.0
        return weights

    def _set_joint(self, weights: NDArray[np.float64], name: str, values: ArrayLike) -> None:
        part = self._parts.get(name)
        if part is None:
            raise CollisionCheckerError(
                f"distance_weights: there is no joint {quoted(name)} with positions of its own"
            )
        rule = f"distance_weights of joint {name!r} must be numbers"
        given = real_array(values, rule, CollisionCheckerError)
        size = part.stop - part.start
        if given.ndim == 0:
            # What is 0 belongs to a quaternion's other entries.
            given = weights[part] * given
        if given.shape != (size,):
            raise CollisionCheckerError(
                f"distance_weights of joint {name!r} must have shape ({size},), not {given.shape}"
            )
        weights[part] = given

    def _check(self, weights: NDArray[np.float64]) -> None:
        names = self._tree.position_names
        bad = np.flatnonzero(~(np.isfinite(weights) & (weights >= 0.0)))
        if len(bad):
            raise CollisionCheckerError(
                f"distance_weights of position {names[bad[0]]!r} must be finite and not negative,"
                f" not {weights[bad[0]]}"
            )
        for start in self._quaternions:
            for row in range(start + 1, start + 4):
                if weights[row] != 0.0:
                    raise CollisionCheckerError(
                        f"distance_weights of position {names[row]!r} must be 0, not"
                        f" {weights[row]}: only the first of a quaternion's four weighs its angle"
                    )

    def _do_compute_configuration_distance(
        self, q1: NDArray[np.float64], q2: NDArray[np.float64]
    ) -> float:
        first, second = self._tree.checked_configurations(np.stack([q1, q2]))
        return float(self.distances(first[np.newaxis], second[np.newaxis])[0])

    def _do_interpolate_between_configurations(
        self, q1: NDArray[np.float64], q2: NDArray[np.float64], ratio: float
    ) -> NDArray[np.float64]:
        between = self._tree.interpolate(q1, q2, ratio)
        if ratio in (0.0, 1.0):
            return q2 if ratio else q1
        # Rounding moves nothing that stays, and an orientation stays as it is written.
        same = q1 == q2
        for start in self._quaternions:
            same[start : start + 4] = same[start : start + 4].all()
        result: NDArray[np.float64] = np.where(same, q1, between)
        return result


@dataclass(frozen=True, eq=False)
class FunctionsProvider(DistanceAndInterpolationProvider):
    """Functions of a user's own; without one of them the linear provider's."""

    linear: LinearDistanceAndInterpolationProvider
    distance_function: ConfigurationDistanceFunction
    interpolation_function: ConfigurationInterpolationFunction | None = None

    def with_distance(self, function: ConfigurationDistanceFunction) -> FunctionsProvider:
        """Return the provider with another function for distances."""
        return replace(self, distance_function=function)

    def with_interpolation(
        self, function: ConfigurationInterpolationFunction | None
    ) -> FunctionsProvider:
        """Return the provider with another function for interpolation."""
        return replace(self, interpolation_function=function)

    def _do_compute_configuration_distance(
        self, q1: NDArray[np.float64], q2: NDArray[np.float64]
    ) -> float:
        return self.distance_function(q1, q2)

    def _do_interpolate_between_configurations(
        self, q1: NDArray[np.float64], q2: NDArray[np.float64], ratio: float
    ) -> ArrayLike:
        if self.interpolation_function is None:
            return self.linear.interpolate_between_configurations(q1, q2, ratio)
        return self.interpolation_function(q1, q2, ratio)


def _units(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions ``(n, 4)`` of length 1."""
    result: NDArray[np.float64] = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    return result


def _alike(q1: ArrayLike, q2: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return copies of two configurations ``(nq,)``, so that no function changes a caller's."""
    first, second = _configuration("q1", q1), _configuration("q2", q2)
    if first.shape != second.shape:
        raise CollisionCheckerError(
            f"q1 and q2 must have the same shape, not {first.shape} and {second.shape}"
        )
    return first, second


def _configuration(name: str, values: ArrayLike) -> NDArray[np.float64]:
    q = real_array(values, f"{name} must be numbers", CollisionCheckerError)
    if q.ndim != 1:
        raise CollisionCheckerError(f"{name} must have shape (nq,), not {q.shape}")
    if not np.isfinite(q).all():
        row = int(np.argmin(np.isfinite(q)))
        raise CollisionCheckerError(f"{name}[{row}] must be finite, not {q[row]}")
    return q
