"""Answers of all convex sets, from each one's parts: rows of a lift, a support, membership."""

from __future__ import annotations

import abc
from collections.abc import Callable
import functools
from typing import Any, ClassVar, Literal, overload

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.answers import Projection, Support
from scene_graph_ros.convex.questions.arguments import (
    as_number,
    as_points,
    as_vector,
)
from scene_graph_ros.convex.questions.certificates import Decision
from scene_graph_ros.convex.questions.conic_program import ConicConstraint, ConicProgram
from scene_graph_ros.convex.questions.decisions import is_bounded, is_empty, meet_by_reach
from scene_graph_ros.convex.questions.generic import (
    inner_point,
    project_on_set,
    support_of_lift,
)
from scene_graph_ros.convex.questions.membership import (
    add_point_in_nonnegative_scaling,
    add_point_in_set,
    Membership,
)
from scene_graph_ros.convex.questions.pieces import Piece
from scene_graph_ros.convex.questions.quick_answers import meet, support_of_rows
from scene_graph_ros.convex.questions.surrounding import drawn_in
from scene_graph_ros.convex.solve.cones.lift import Lift, shared_point
from scene_graph_ros.convex.solve.cutting.cutting import find_in_cones, Found
from scene_graph_ros.convex.solve.exact.corners import Corners
from scene_graph_ros.convex.solve.exact.maximize import maximize
from scene_graph_ros.convex.volumes.sampled_volume import (
    sample_volume,
    SampledVolume,
)
from scene_graph_ros.convex.volumes.volume_interval import (
    volume_interval,
    VolumeInterval,
)
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["ConvexSet"]

DEFAULT_TOLERANCE = 1e-8
"""In the set's own units, metres or radians: how far outside a point may be to count as inside."""


@one_line("ambient_dimension")
class ConvexSet(abc.ABC):
    """A closed convex set in n dimensions, n from 0 on. Sets are values: nothing changes them.

    Points are rows. Sets in no dimensions are {0}, unless said otherwise.
    """

    _IS_NEVER_EMPTY: ClassVar[bool] = False
    """Whether every set of the kind has a point."""

    _IS_ALWAYS_BOUNDED: ClassVar[bool] = False
    """Whether every set of the kind is bounded."""

    _HAS_QUICK_SUPPORT: ClassVar[bool] = False
    """Whether the kind knows how far it reaches, where its rows take long to ask."""

    def __init__(self, ambient_dimension: int) -> None:
        self._ambient_dimension = ambient_dimension

    @property
    def ambient_dimension(self) -> int:
        """The number n of coordinates of a point."""
        return self._ambient_dimension

    @abc.abstractmethod
    def lift(self) -> Lift:
        """Return the rows of the lift of the set, without rounding."""

    @functools.cached_property
    def lifted(self) -> Lift:
        """The kept answer of `lift`."""
        return self.lift()

    @functools.cached_property
    def found(self) -> Found:
        """A point of the lift, or the proof that there is none, kept."""
        return find_in_cones(shared_point([self.lifted], self._ambient_dimension))

    @abc.abstractmethod
    def _outside(self, points: np.ndarray) -> np.ndarray:
        """Return lower bounds of points' distances ``(m,)``, by the kind's rows; 0 inside."""

    def _are_near(self, points: np.ndarray, tol: float) -> np.ndarray:
        """Return a mask ``(m,)`` of points ``(m, n)`` at most ``tol`` from the set.

        Here for kinds that know the distance itself.
        """
        return self._outside(points) <= tol

    def _holds(self, points: np.ndarray) -> np.ndarray:
        """Return a mask ``(m,)`` of points ``(m, n)`` inside, in floats."""
        return self._outside(points) <= 0.0

    def clone(self) -> ConvexSet:
        """Return the set: it never changes."""
        return self

    def point_in_set(self, x: Any, tol: float = DEFAULT_TOLERANCE) -> Any:
        """Tell whether points are inside, or at most ``tol``, a distance, from a point inside.

        ``x`` is ``(n,)``, or ``(m, n)`` for an array ``(m,)`` of answers. Raises ConvexSetError,
        also for a negative ``tol``.
        """
        points, is_one = as_points(
            x, f"{type(self).__name__}.point_in_set: x", self._ambient_dimension
        )
        label = f"{type(self).__name__}.point_in_set: tol"
        most = as_number(tol, label)
        if most < 0.0:
            raise ConvexSetError(f"{label} must be at least 0, not {most!r}")
        inside = self._are_near(points, most)
        return bool(inside[0]) if is_one else inside

    @overload
    def is_empty(self, *, certificate: Literal[False] = ...) -> bool: ...

    @overload
    def is_empty(self, *, certificate: Literal[True]) -> Decision: ...

    def is_empty(self, *, certificate: bool = False) -> bool | Decision:
        """Tell whether the set has no point; with its proof on request.

        The certificate is a ``point`` or ``farkas``.
        """
        quick = None if certificate else self._is_quickly_empty()
        if quick is not None:
            return quick
        decision = is_empty((self,), "is_empty")
        return decision if certificate else decision.value

    def _is_quickly_empty(self) -> bool | None:
        """Tell whether the set is empty where that is seen at once; None where it isn't."""
        return False if self._IS_NEVER_EMPTY else None

    @overload
    def is_bounded(self, *, certificate: Literal[False] = ...) -> bool: ...

    @overload
    def is_bounded(self, *, certificate: Literal[True]) -> Decision: ...

    def is_bounded(self, *, certificate: bool = False) -> bool | Decision:
        """Tell whether a box contains the set; with its proof on request.

        The certificate is ``multipliers``, ``farkas`` for an empty set, or ``recession``.
        """
        quick = None if certificate else self._is_quickly_bounded()
        if quick is not None:
            return quick
        decision = is_bounded(self)
        return decision if certificate else decision.value

    def _is_quickly_bounded(self) -> bool | None:
        """Tell whether the set is bounded where that is seen at once; None where it isn't."""
        return True if self._IS_ALWAYS_BOUNDED else None

    def _inner(self, question: str) -> np.ndarray:
        """Return a point of the lift in floats. Raises ConvexSetError where the set is empty."""
        return inner_point(self, question)[0]

    def _are_near_by_projection(self, points: np.ndarray, tol: float) -> np.ndarray:
        """Return a mask of points at most ``tol`` from the set, by its nearest points."""
        if self.is_empty():
            return np.zeros(len(points), dtype=np.bool_)
        if tol == np.inf:
            return np.ones(len(points), dtype=np.bool_)
        nearest = self._project(points)
        near: np.ndarray = nearest.distances - nearest.gaps <= tol
        return near

    def _linear_rows(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return read-only rows of coordinates alone that are the set, None if there are none."""
        return None

    @property
    def own_box(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Corners ``(n,)`` of the set where it is shown at once to be a bounded box."""
        return None

    @overload
    def intersects_with(self, other: ConvexSet, *, certificate: Literal[False] = ...) -> bool: ...

    @overload
    def intersects_with(self, other: ConvexSet, *, certificate: Literal[True]) -> Decision: ...

    def intersects_with(self, other: ConvexSet, *, certificate: bool = False) -> bool | Decision:
        """Tell whether the sets have a point in common; with its proof on request.

        Raises ConvexSetError for a set of another dimension.
        """
        self._check_other(other, "intersects_with")
        quick = None if certificate else meet(self, other)
        if quick is not None:
            return quick
        quick = None if certificate else meet_by_reach(self, other)
        if quick is not None:
            return quick
        decision = is_empty((self, other), "intersects_with")
        return (
            Decision(not decision.value, decision.certificate)
            if certificate
            else not decision.value
        )

    def _inner_reach(self, d: np.ndarray) -> tuple[np.ndarray, float] | None:
        """Return a point ``(n,)`` nearly as far along d as the set reaches, None if unknown.

        Behind it is what rounding may have moved each coordinate by.
        """
        return drawn_in(self, d)

    def _pieces(self, d: np.ndarray, within: float) -> list[Piece] | None:
        """Return the parts that reach furthest along a unit vector, but for ``within``.

        At least one; None where they are not known.
        """
        return None

    def _has_matrices(self) -> bool:
        """Tell whether a program has to be solved for how far the set reaches."""
        return not self._HAS_QUICK_SUPPORT and bool(self.lifted.matrices)

    def _hull_of_points(self) -> Callable[[np.ndarray], ConvexSet] | None:
        """Return the kind of set that points of this one, as far as it reaches, are the hull of.

        None where these are rounded, and may be outside.
        """
        return None

    @functools.cached_property
    def corners(self) -> Corners | None:
        """A set that isn't empty as sums and hulls of points and boxes, None where it isn't."""
        return None

    def _check_other(self, other: Any, question: str, kind: type[ConvexSet] | None = None) -> None:
        """Raise ConvexSetError unless it is a set of a kind and of this set's dimension."""
        label = f"{type(self).__name__}.{question}: other"
        wanted = ConvexSet if kind is None else kind
        if not isinstance(other, wanted):
            name = wanted.__name__
            article = "an" if name.startswith(("A", "HP", "I")) else "a"
            raise ConvexSetError(f"{label} must be {article} {name}, not {quoted(other)}")
        if other.ambient_dimension != self.ambient_dimension:
            raise ConvexSetError(
                f"{label} has {other.ambient_dimension} dimensions, this set has"
                f" {self.ambient_dimension}"
            )

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the set's only point ``(n,)`` where its description shows it at once, or None."""
        return np.zeros(0) if self._ambient_dimension == 0 and not self.is_empty() else None

    def maybe_get_feasible_point(self) -> np.ndarray | None:
        """Return a point ``(n,)`` of the set, rounded to floats; None if there is none."""
        decision = self.is_empty(certificate=True)
        if decision.value:
            return None
        return decision.certificate.vector[: self._ambient_dimension]

    def support(self, direction: Any) -> Support:
        """Return the set's support along a direction ``(n,)``, which may have any length.

        Raises ConvexSetError for an empty set.
        """
        d = as_vector(
            direction, f"{type(self).__name__}.support: direction", self.ambient_dimension
        )
        return self._support(d)

    def _support(self, d: np.ndarray) -> Support:
        if self.lifted.cones:
            return support_of_lift(self, d)
        start = self._inner("support")
        alone = self._linear_rows()
        quick = None if alone is None else support_of_rows(*alone, start, d)
        if quick is not None:
            return quick
        rows, n = self.lifted.rows, self.ambient_dimension
        c = np.zeros(rows.A.shape[1])
        c[:n] = d
        optimum = maximize(rows, c, start)
        if optimum.ray is not None:
            return Support(np.inf, optimum.ray[:n], 0.0)
        return Support(optimum.value, optimum.x[:n], optimum.gap)

    def projection(self, points: Any) -> Projection | None:
        """Return the nearest points of the set to points ``(m, n)``, None if it is empty.

        Raises ConvexSetError for points of another size, SolverError where the nearest could not
        be found as exactly as promised.
        """
        label = f"{type(self).__name__}.projection: points"
        checked, _ = as_points(points, label, self.ambient_dimension)
        return None if self.is_empty() else self._project(checked)

    def _project(self, points: np.ndarray) -> Projection:
        """Return the nearest points of a set that isn't empty."""
        return project_on_set(self, points)

    @property
    def has_exact_volume(self) -> bool:
        """Whether `calc_volume` has an answer."""
        return False

    def calc_volume(self) -> float:
        """Return the volume. Raises ConvexSetError where the kind has none that is exact."""
        if self.ambient_dimension == 0:
            raise ConvexSetError(
                f"{type(self).__name__}.calc_volume: there is none in 0 dimensions"
            )
        if not self.has_exact_volume:
            raise ConvexSetError(
                f"{type(self).__name__}.calc_volume: there is no exact volume of this kind in"
                f" {self.ambient_dimension} dimensions; use calc_volume_via_sampling"
            )
        return self._volume()

    def _volume(self) -> float:
        raise NotImplementedError

    def calc_volume_via_sampling(
        self,
        generator: np.random.Generator,
        desired_rel_accuracy: float = 0.01,
        max_num_samples: int = 10_000,
    ) -> SampledVolume:
        """Estimate the volume by the share of points of the set's box that are inside.

        Ends where the standard error is the desired one, relative to the volume, or with the last
        sample; the volume is within twice the error with 95 %. In many dimensions few points of
        the box are inside. Raises ConvexSetError for a set that is unbounded or has no dimensions.
        """
        return sample_volume(self, generator, desired_rel_accuracy, max_num_samples)

    def calc_volume_interval(
        self,
        generator: np.random.Generator,
        desired_rel_accuracy: float = 0.01,
        confidence: float = 0.95,
        max_num_samples: int = 1_000_000,
    ) -> VolumeInterval:
        """Return bounds that the volume is between with at least a probability.

        Exact volumes to their rounding, polyhedra beyond four dimensions from independent rays,
        others from independent points of their box: no walk has to have mixed. Ends where both
        bounds are within ``desired_rel_accuracy`` of their middle, or with the last sample. Raises
        ConvexSetError for a set that is unbounded or has no dimensions, or a flat polyhedron.
        """
        return volume_interval(self, generator, desired_rel_accuracy, confidence, max_num_samples)

    def add_point_in_set_constraints(self, program: ConicProgram, x: Any) -> Membership:
        """Ask in a program that its variables ``x (n,)`` are a point of the set.

        Returns the variables and constraints that were added. Raises ConvexSetError in no
        dimensions.
        """
        return add_point_in_set(self, program, x)

    def add_point_in_nonnegative_scaling_constraints(
        self, program: ConicProgram, *point_and_scale: Any
    ) -> list[ConicConstraint]:
        """Ask in a program that a point is in a multiple of the set, which is at least 0.

        ``(program, x, t)``: variables ``x (n,)`` in t times the set, t one variable.
        ``(program, A, b, c, d, x, t)``: ``A x + b`` in ``c . t + d`` times it, of variables
        ``x (k,)`` and ``t (p,)``, ``A (n, k)``, ``b (n,)``, ``c (p,)`` and a number d.

        Where the multiple is 0, the point is a direction in which the set goes on for ever, or 0;
        of an empty set one that breaks none of its rows. Returns the constraints that were added.
        Raises ConvexSetError in no dimensions.
        """
        return add_point_in_nonnegative_scaling(self, program, point_and_scale)

    def to_shape_with_pose(self) -> tuple[Shape, np.ndarray]:
        """Return a shape and its pose ``(4, 4)`` that are the set, in three dimensions.

        Raises ConvexSetError where no shape is this set.
        """
        if self.ambient_dimension != 3:
            raise ConvexSetError(
                f"{type(self).__name__}.to_shape_with_pose: shapes have 3 dimensions, the set has"
                f" {self.ambient_dimension}"
            )
        return self._shape_with_pose()

    # The set in the words of another kind, for that kind's constructor; None where there are none.

    def _half_spaces(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return rows ``A (m, n)`` and right sides ``b (m,)`` that are the set."""
        return None

    def _corners(self) -> np.ndarray | None:
        """Return points ``(m, n)`` whose hull is the set."""
        return None

    def _ball_map(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return ``B (n, n)`` and ``center (n,)``: the set is the image of the unit ball."""
        return None

    def _shape_with_pose(self) -> tuple[Shape, np.ndarray]:
        raise ConvexSetError(
            f"{type(self).__name__}.to_shape_with_pose: no shape is a set of this kind"
        )
