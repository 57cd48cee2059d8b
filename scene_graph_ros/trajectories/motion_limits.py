"""How fast joints may move, and where a trajectory is faster."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array, whole_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.located import suggestion
from scene_graph_ros.trajectories.curve_kernels import write_hermite, write_hermite_rates
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.extremes import largest_ratios
from scene_graph_ros.trajectories.extremes_kernels import largest_rate
from scene_graph_ros.trajectories.limit_rounding import LIMIT_ROUNDING, RATE_ROUNDING
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.polynomials_of import Polynomials, polynomials_of

__all__ = [
    "LimitExcess",
    "MotionLimits",
    "find_excess",
    "value_excess",
    "worst_ratio",
    "worst_ratio_of",
]


@one_line()
class LimitExcess(NamedTuple):
    """Where a trajectory is farthest beyond one of its limits."""

    kind: str
    """``"position"``, ``"velocity"``, ``"acceleration"`` or ``"jerk"``."""
    row: int
    """Which entry of the trajectory."""
    value: float
    limit: float
    time: float
    """s."""

    @property
    def ratio(self) -> float:
        """The value in units of its limit."""
        return abs(self.value / self.limit) if self.limit else np.inf

    def words(self, name: str) -> str:
        """Return it in words, with the name of the entry."""
        return (
            f"{self.kind} of {name!r} is {self.value:.10g} at {self.time:.6g} s, beyond its limit"
            f" {self.limit:.10g} by {abs(self.value - self.limit):.3g}"
        )


class NamedPositions(Protocol):
    """The entries of a configuration, such as those of a `KinematicTree`."""

    @property
    def position_names(self) -> tuple[str, ...]:
        """The names of its entries."""

    @property
    def velocity_limits(self) -> NDArray[np.float64]:
        """Their largest speeds ``(nq,)``, in rad/s and m/s; infinite where there is no limit."""

    @property
    def acceleration_limits(self) -> NDArray[np.float64]:
        """Their largest accelerations ``(nq,)``, as of `velocity_limits`."""

    @property
    def jerk_limits(self) -> NDArray[np.float64]:
        """Their largest jerks ``(nq,)``, as of `velocity_limits`."""


_KINDS = ("velocity", "acceleration", "jerk")
"""Of limits, by the order of the derivative."""

_LEAST, _MOST = 1e-12, 1e18
"""Of a limit: no robot has others, and what is worked out of them stays far from infinite."""


@one_line()
@dataclass(frozen=True, eq=False)
class MotionLimits:
    """The largest velocities, accelerations and perhaps jerks ``(n,)`` of a trajectory's entries.

    In rad/s, rad/s^2 and rad/s^3, or m/s, m/s^2 and m/s^3; both ways alike. Raises
    TrajectoryError for limits outside of 1e-12 to 1e18, naming the entry by ``names``, or by its
    number.
    """

    velocities: NDArray[np.float64]
    accelerations: NDArray[np.float64]
    names: tuple[str, ...] = ()
    jerks: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        """Check the arrays."""
        if not isinstance(self.names, (tuple, list)):
            raise TrajectoryError(
                f"names must be texts, not {quoted(self.names)}: jerks are given by that name"
            )
        for kind in ("velocities", "accelerations", "jerks"):
            if getattr(self, kind) is None:
                continue
            values = real_array(getattr(self, kind), f"{kind} must be numbers", TrajectoryError)
            if values.ndim != 1 or (self.names and len(values) != len(self.names)):
                raise TrajectoryError(
                    f"{kind} must have one number for each entry: {values.shape}"
                )
            bad = np.flatnonzero(~((values >= _LEAST) & (values <= _MOST)))
            if len(bad):
                i = int(bad[0])
                raise TrajectoryError(
                    f"the limit of {kind} of {self.name(i)!r} must be from {_LEAST:g} to"
                    f" {_MOST:g}, not {values[i]:g}"
                )
            values.setflags(write=False)
            object.__setattr__(self, kind, values)
        if self.velocities.shape != self.accelerations.shape:
            raise TrajectoryError(
                f"there are {len(self.velocities)} velocities and {len(self.accelerations)}"
                " accelerations"
            )
        if self.jerks is not None and self.jerks.shape != self.velocities.shape:
            raise TrajectoryError(
                f"there are {len(self.velocities)} velocities and {len(self.jerks)} jerks"
            )

    def name(self, row: int) -> str:
        """Return the name of an entry."""
        return self.names[row] if self.names else str(row)

    @classmethod
    def of_tree(
        cls,
        tree: NamedPositions,
        *,
        accelerations: Mapping[str, float] | float | None = None,
        velocities: Mapping[str, float] | None = None,
        jerks: Mapping[str, float] | float | None = None,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        positions: ArrayLike | None = None,
    ) -> MotionLimits:
        """Return the limits of a robot's positions: velocities of its URDF, unless given.

        ``accelerations``, and ``jerks`` where there are limits of these, are given by position, or
        one for all; the robot's own, which `joint_limits.yaml` gives it, narrow them.
        ``positions`` ``(k,)`` are the entries of q that move, by default all; only
        these have limits. Scalings are in (0, 1]; jerks have none.
        Raises TrajectoryError for an unknown name, and for an entry without a limit.
        """
        names = tree.position_names
        rows = np.arange(len(names))
        if positions is not None:
            rule = f"positions must be entries of q (k,), from 0 to {len(names) - 1}"
            rows = whole_array(positions, rule, TrajectoryError)
            if rows.ndim != 1 or not ((rows >= 0) & (rows < len(names))).all():
                raise TrajectoryError(f"{rule}: {quoted(positions)}")
        own = dict(zip(names, tree.velocity_limits.tolist(), strict=True))
        own.update(_known(tree, "velocities", velocities or {}))
        most = _narrowest(tree, "accelerations", accelerations, tree.acceleration_limits)
        own_jerks = tree.jerk_limits
        has_jerks = jerks is not None or bool(np.isfinite(own_jerks[rows]).any())
        changes = _narrowest(tree, "jerks", jerks, own_jerks) if has_jerks else None
        factors = [
            _scaling(name, value)
            for name, value in (
                ("velocity_scaling", velocity_scaling),
                ("acceleration_scaling", acceleration_scaling),
            )
        ]
        chosen = tuple(names[row] for row in rows)
        for kind, given in (("velocity", own), ("acceleration", most), ("jerk", changes)):
            for name in chosen:
                if given is not None and not given.get(name, np.inf) < np.inf:
                    raise TrajectoryError(f"position {name!r} has no limit of {kind}")
        return cls(
            factors[0] * np.array([own[name] for name in chosen], dtype=np.float64),
            factors[1] * np.array([most[name] for name in chosen], dtype=np.float64),
            chosen,
            None if changes is None else np.array([changes[name] for name in chosen]),
        )


def find_excess(
    trajectory: Polynomials,
    limits: MotionLimits,
    *,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
) -> LimitExcess | None:
    """Return a trajectory's largest excess over a limit, or None: it is within, at all times.

    That is proven by bounds of its polynomials, not by samples. A value beyond a limit by less
    than 1e-12 of it is at it. ``lower`` and ``upper`` ``(n,)`` are limits of its values, 1e-9
    beyond which is still at them. Raises TrajectoryError for a trajectory that is no polynomials.
    """
    trajectory = polynomials_of("trajectory", trajectory)
    n = trajectory.rows
    if n != len(limits.velocities):
        raise TrajectoryError(
            f"the trajectory has {n} rows, and there are limits of {len(limits.velocities)}"
        )
    sides = _limit("lower", lower, n), _limit("upper", upper, n)
    worst = worst_ratio(trajectory, limits)
    if worst.ratio > 1.0 + RATE_ROUNDING:
        return worst
    return value_excess(trajectory, *sides)


def value_excess(
    trajectory: PiecewisePolynomial,
    lower: NDArray[np.float64] | None,
    upper: NDArray[np.float64] | None,
) -> LimitExcess | None:
    """Return a trajectory's largest excess over limits ``(n,)`` of its values, or None."""
    points = trajectory.control_points
    for limit, side in ((lower, -1.0), (upper, 1.0)):
        # A limit is no scale: what counts is the way beyond it.
        if limit is not None and (side * (points - limit) > LIMIT_ROUNDING).any():
            found = _beyond(trajectory, limit, side)
            if found is not None:
                return found
    return None


def _limit(name: str, given: ArrayLike | None, size: int) -> NDArray[np.float64] | None:
    """Return a limit of each position, which may be infinite. Raises TrajectoryError."""
    if given is None:
        return None
    rule = f"{name} must be numbers ({size},)"
    limit = real_array(given, rule, TrajectoryError)
    if limit.shape != (size,) or np.isnan(limit).any():
        raise TrajectoryError(f"{rule}, not {quoted(given)}")
    return limit


def worst_ratio(trajectory: PiecewisePolynomial, limits: MotionLimits) -> LimitExcess:
    """Return the velocity, acceleration or jerk that is largest in units of its limit."""
    breaks = trajectory.breaks
    return _worst(breaks, np.diff(breaks), np.array(trajectory.control_points), limits)


def worst_ratio_of(
    nanoseconds: NDArray[np.int64],
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    a: NDArray[np.float64] | None,
    limits: MotionLimits,
) -> LimitExcess:
    """Return it of the curve through states ``(m, n)`` at times that `TrajectoryPoints` have.

    That is of its exact polynomials; where these keep all limits, of their control points as they
    are rounded: positions of short segments far from zero have rates of their rounding.
    """
    times = nanoseconds.astype(np.float64) * 1e-9
    widths = np.diff(nanoseconds).astype(np.float64) * 1e-9
    times.setflags(write=False)  # As the breaks of curves are.
    own, degree = (v, 3) if a is None else (a, 5)
    rates = np.empty((len(widths), degree, q.shape[1]))
    write_hermite_rates(widths, q, v, own, rates)
    exact = _worst(times, widths, rates, limits, is_rate=True)
    if exact.ratio > 1.0 + RATE_ROUNDING:
        return exact
    control = np.empty((len(widths), degree + 1, q.shape[1]))
    write_hermite(times, q, v, own, control)
    rounded = _worst(times, np.diff(times), control, limits)
    return max(exact, rounded, key=lambda worst: worst.ratio)


def _worst(
    breaks: NDArray[np.float64],
    widths: NDArray[np.float64],
    control: NDArray[np.float64],
    limits: MotionLimits,
    *,
    is_rate: bool = False,
) -> LimitExcess:
    """Return it of polynomials, whose control points are written over."""
    given = (limits.velocities, limits.accelerations, limits.jerks)
    most = np.stack([each for each in given if each is not None])
    order, row, ratio, time = largest_rate(breaks, widths, control, most, is_rate)
    limit = float(most[order - 1, row])
    return LimitExcess(_KINDS[order - 1], row, ratio * limit, limit, time)


def _beyond(
    trajectory: PiecewisePolynomial, limit: NDArray[np.float64], side: float
) -> LimitExcess | None:
    """Return the largest excess of values over limits, if there is one."""
    finite = np.isfinite(limit)
    shifted = np.where(finite, side * (trajectory.control_points - limit), 0.0)
    moved = PiecewisePolynomial(trajectory.breaks, shifted)
    one = np.ones(len(limit))
    peak = largest_ratios(moved, np.full(len(limit), -np.inf), one)
    row = int(np.argmax(peak.bounds))
    if peak.bounds[row] <= LIMIT_ROUNDING:
        return None
    value = float(limit[row] + side * peak.bounds[row])
    return LimitExcess("position", row, value, float(limit[row]), float(peak.times[row]))


def _known(tree: NamedPositions, what: str, given: Mapping[str, float]) -> dict[str, float]:
    for name, value in given.items():
        if name not in tree.position_names:
            raise TrajectoryError(
                f"{what}: there is no position {quoted(name)}"
                f"{suggestion(name, tree.position_names)}"
            )
        if as_float(value) is None:
            raise TrajectoryError(f"{what} of {name!r} must be a number, not {quoted(value)}")
    return {name: float(value) for name, value in given.items()}


def _narrowest(
    tree: NamedPositions,
    what: str,
    given: Mapping[str, float] | float | None,
    own: NDArray[np.float64],
) -> dict[str, float]:
    """Return limits by position: those given, or the robot's own where these are narrower."""
    result = {} if given is None else _by_name(tree, what, given)
    for name, most in zip(tree.position_names, own.tolist(), strict=True):
        if most < np.inf and not result.get(name, np.inf) < most:
            result[name] = most
    return result


def _by_name(
    tree: NamedPositions, what: str, given: Mapping[str, float] | float
) -> dict[str, float]:
    """Return limits by position, also if they are given once for all."""
    if isinstance(given, Mapping):
        return _known(tree, what, given)
    one = as_float(given)
    if one is None:
        raise TrajectoryError(f"{what} must be numbers: {quoted(given)}")
    return dict.fromkeys(tree.position_names, one)


def _scaling(name: str, value: float) -> float:
    number = as_float(value)
    if number is None or not 0.0 < number <= 1.0:
        raise TrajectoryError(f"{name} must be in (0, 1], not {quoted(value)}")
    return number
