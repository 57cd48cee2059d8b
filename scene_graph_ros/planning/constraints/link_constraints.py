"""Conditions on the orientation and the position of a link, as motions have to hold them.

Notation: W is the world, L the link, A the frame in which the condition is stated, T a tool fixed
to the link, Q a point of it, F the frame of a box.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.spatial.poses import as_pose
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE
from scene_graph_ros.planning.errors import PlanningError

__all__ = [
    "LEAST_ANGLE",
    "LEAST_WIDTH",
    "MOST_CONSTRAINTS",
    "AngleBetweenVectorsConstraint",
    "LinkConstraint",
    "OrientationConstraint",
    "PositionConstraint",
    "as_constraints",
]

LEAST_ANGLE = 1e-4
"""rad: the least bound of an angle, and the least range of one. A straight edge leaves a tighter
one after a few thousandths of a radian, so paths would have thousands of edges."""

LEAST_WIDTH = 1e-4
"""m: the least side of a box, for the same reason."""

MOST_CONSTRAINTS = 32
"""Of one motion."""


def _vector(name: str, value: Any) -> NDArray[np.float64]:
    """Return three finite numbers. Raises PlanningError naming them."""
    rule = f"{name} must be three finite numbers"
    result = real_array(value, rule, PlanningError)
    if result.shape != (3,) or not np.isfinite(result).all():
        raise PlanningError(f"{rule}, not {quoted(value)}")
    return result


def _direction(name: str, value: Any) -> NDArray[np.float64]:
    """Return a vector of length 1. Raises PlanningError naming it."""
    vector = _vector(name, value)
    largest = float(np.abs(vector).max())
    if not largest > 0.0:
        raise PlanningError(f"{name} must not be zero")
    vector /= largest
    return np.asarray(vector / math.sqrt(float((vector * vector).sum())))


def _rotation(name: str, value: Any) -> NDArray[np.float64]:
    """Return a rotation ``(3, 3)``. Raises InvalidPoseError naming it."""
    rule = f"{name} must be a rotation (3, 3)"
    matrix = real_array(value, rule, PlanningError)
    if matrix.shape != (3, 3):
        raise PlanningError(f"{rule}, not of shape {matrix.shape}")
    X = np.eye(4)
    X[:3, :3] = matrix
    return np.ascontiguousarray(as_pose(X, name)[:3, :3])


def _angle(name: str, value: Any) -> float:
    number = as_float(value)
    if number is None or not math.isfinite(number):
        raise PlanningError(f"{name} must be a finite number (rad), not {quoted(value)}")
    return number


def _name(what: str, value: object) -> str:
    if not isinstance(value, str) or not value:
        raise PlanningError(f"{what} must be the name of a link, not {quoted(value)}")
    return value


@one_line()
@dataclass(frozen=True, eq=False)
class LinkConstraint:
    """A condition on the pose of ``link`` in a ``frame``: another link, or else the world."""

    unit: ClassVar[str] = "rad"

    link: str

    def _check_names(self) -> None:
        _name("link of a constraint", self.link)
        frame = getattr(self, "frame", None)
        if frame is not None:
            _name("frame of a constraint", frame)
            if frame == self.link:
                raise PlanningError(
                    f"frame of a constraint must not be its own link {self.link!r}"
                )


@one_line()
@dataclass(frozen=True, eq=False)
class AngleBetweenVectorsConstraint(LinkConstraint):
    """The angle between a vector ``a_A`` of A and a vector ``b_L`` of the link stays in a range.

    That is from ``angle_lower`` to ``angle_upper``, rad. ``a_A`` ``(3,)`` is of ``frame``: a link,
    or the world where it is None; ``b_L`` ``(3,)`` is of the link; their lengths do not matter.
    A cup stays upright where a_A is up in the world and b_L is the cup's axis. Raises
    PlanningError for a vector that is zero or not finite, for angles beyond [0, pi] or reversed,
    and where the range is below 1e-4.
    """

    a_A: NDArray[np.float64]
    b_L: NDArray[np.float64]
    angle_upper: float
    angle_lower: float = 0.0
    frame: str | None = None

    def __post_init__(self) -> None:
        """Check and copy the arguments."""
        self._check_names()
        for name in ("a_A", "b_L"):
            object.__setattr__(self, name, _direction(name, getattr(self, name)))
        lower, upper = (_angle(f"angle_{end}", getattr(self, f"angle_{end}")) for end in _ENDS)
        if not 0.0 <= lower <= upper <= _LARGEST:
            raise PlanningError(
                "angle_lower and angle_upper must be from 0 to pi, and not reversed, not"
                f" {lower:.10g} and {upper:.10g}"
            )
        if upper - lower < LEAST_ANGLE:
            raise PlanningError(
                f"angle_upper must be above angle_lower by {LEAST_ANGLE:g} rad at least, not by"
                f" {upper - lower:.4g}"
            )
        object.__setattr__(self, "angle_lower", lower)
        object.__setattr__(self, "angle_upper", upper)


@one_line()
@dataclass(frozen=True, eq=False)
class OrientationConstraint(LinkConstraint):
    """A tool T of the link stays turned from an orientation in A by at most ``theta_bound``, rad.

    ``R_AT`` ``(3, 3)`` is that orientation, ``R_LT`` the tool's in the link; ``frame`` is A, a
    link, or the world where it is None. Raises PlanningError for a bound that is below 1e-4 or not
    finite, InvalidPoseError for a matrix that is no rotation.
    """

    R_AT: NDArray[np.float64]
    theta_bound: float
    R_LT: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    frame: str | None = None

    def __post_init__(self) -> None:
        """Check and copy the arguments."""
        self._check_names()
        for name in ("R_AT", "R_LT"):
            object.__setattr__(self, name, _rotation(name, getattr(self, name)))
        bound = _angle("theta_bound", self.theta_bound)
        if bound < LEAST_ANGLE:
            raise PlanningError(f"theta_bound must be {LEAST_ANGLE:g} rad at least, not {bound:g}")
        object.__setattr__(self, "theta_bound", bound)


@one_line()
@dataclass(frozen=True, eq=False)
class PositionConstraint(LinkConstraint):
    """A point Q of the link stays in a box, which stands at ``X_AF`` ``(4, 4)`` in A.

    ``p_FQ_lower`` and ``p_FQ_upper`` ``(3,)`` are its coordinates in the box's frame F, m;
    infinite ones say nothing. Q is at ``p_LQ`` ``(3,)`` in the link. ``frame`` is A, a link, or
    the world where it is None. Raises PlanningError for NaN, for bounds that are reversed or
    nearer to each other than 1e-4 m, and for coordinates beyond all scenes; InvalidPoseError for
    a pose that is not rigid.
    """

    unit: ClassVar[str] = "m"

    p_FQ_lower: NDArray[np.float64]
    p_FQ_upper: NDArray[np.float64]
    p_LQ: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    X_AF: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    frame: str | None = None

    def __post_init__(self) -> None:
        """Check and copy the arguments."""
        self._check_names()
        for name in ("p_FQ_lower", "p_FQ_upper"):
            object.__setattr__(self, name, _bound(name, getattr(self, name)))
        object.__setattr__(self, "p_LQ", _vector("p_LQ", self.p_LQ))
        object.__setattr__(self, "X_AF", as_pose(self.X_AF, "X_AF"))
        for name, values in (("p_LQ", self.p_LQ), ("X_AF", self.X_AF[:3, 3])):
            if not (np.abs(values) <= MAX_COORDINATE).all():
                raise PlanningError(f"{name} is beyond {MAX_COORDINATE:g} m: {quoted(values)}")
        with np.errstate(invalid="ignore"):
            widths = self.p_FQ_upper - self.p_FQ_lower
        narrow = ~(widths >= LEAST_WIDTH)
        if narrow.any():
            k = int(np.argmax(narrow))
            raise PlanningError(
                f"p_FQ_upper must be above p_FQ_lower by {LEAST_WIDTH:g} m at least, not"
                f" {self.p_FQ_upper[k]:.10g} and {self.p_FQ_lower[k]:.10g} in {'xyz'[k]}"
            )


_ENDS = ("lower", "upper")
_LARGEST = math.pi * (1.0 + 1e-12)


def _bound(name: str, value: ArrayLike) -> NDArray[np.float64]:
    rule = f"{name} must be three numbers"
    result = real_array(value, rule, PlanningError)
    if result.shape != (3,) or np.isnan(result).any():
        raise PlanningError(f"{rule}, not {quoted(value)}")
    return result


def as_constraints(constraints: Iterable[object]) -> tuple[Any, ...]:
    """Return constraints as a tuple. Raises PlanningError for anything else, and for too many."""
    if isinstance(constraints, LinkConstraint):
        raise PlanningError("constraints must be a list of constraints, not one by itself")
    try:
        found = tuple(constraints)
    except TypeError:
        raise PlanningError(
            f"constraints must be a list of constraints, not {quoted(constraints)}"
        ) from None
    for each in found:
        if not isinstance(each, LinkConstraint) or type(each) is LinkConstraint:
            raise PlanningError(
                "constraints must be AngleBetweenVectorsConstraint, OrientationConstraint or"
                f" PositionConstraint, not {quoted(each)}"
            )
    if len(found) > MOST_CONSTRAINTS:
        raise PlanningError(
            f"constraints must be {MOST_CONSTRAINTS} at most, and there are {len(found)}"
        )
    return found
