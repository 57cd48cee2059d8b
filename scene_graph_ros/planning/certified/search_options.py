"""Options of searches for certified polytopes, under the names they have in the literature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
import enum
import math
from typing import Any, TypeVar

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.solve.cones.solver_choice import (
    as_choice,
    CONTINUOUS,
    SolverChoice,
)
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.certified.errors import CertificateError

__all__ = [
    "BilinearAlternationOptions",
    "BinarySearchOptions",
    "EllipsoidMarginCost",
    "FindPolytopeGivenLagrangianOptions",
    "FindSeparationCertificateGivenPolytopeOptions",
    "FindSeparationCertificateOptions",
    "as_given_polytope",
    "as_search_options",
]

Options = TypeVar("Options")


class EllipsoidMarginCost(enum.Enum):
    """The largest of the margins between a polytope's faces and the ellipsoid inside."""

    SUM = "sum"
    """One face may stay where it is for the others."""
    GEOMETRIC_MEAN = "geometric mean"
    """That of margins and an epsilon: faces move more alike."""


@one_line()
@dataclass(frozen=True, kw_only=True)
class FindSeparationCertificateOptions:
    """How planes are searched for.

    ``solver_id`` is None for the method of our own, which asks Clarabel where rounding ends it; or
    a solver's name, as ``"clarabel"``, which then solves the whole program, with
    ``solver_options`` of its own. Raises CertificateError naming the option.
    """

    terminate_at_failure: bool = True
    solver_id: str | None = None
    solver_options: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        """Raise CertificateError naming the option."""
        for each in fields(self):
            value = getattr(self, each.name)
            if not each.name.startswith("solver_") and type(value) is not bool:
                raise CertificateError(f"{each.name} must be True or False, not {quoted(value)}")
        _solver_of(self)

    @property
    def solver(self) -> SolverChoice | None:
        """The solver that is chosen; None for the method of our own."""
        return _solver_of(self)


@one_line()
@dataclass(frozen=True, kw_only=True)
class FindSeparationCertificateGivenPolytopeOptions(FindSeparationCertificateOptions):
    """How planes are searched for in a polytope.

    With ``ignore_redundant_C`` rows that the others imply exactly have no multipliers; the region
    is the same. With ``most_clearance`` the pairs that keep least get the best planes.
    """

    ignore_redundant_C: bool = False
    most_clearance: bool = True


@one_line()
@dataclass(frozen=True, kw_only=True)
class FindPolytopeGivenLagrangianOptions:
    """How faces move where the multipliers of their rows are given.

    ``backoff_scale`` is the share of the faces' best cost that is given up, so that planes have
    the most clearance within the rest; None for none. Without ``search_s_bounds_lagrangians`` the
    multipliers of the bounds of s stay as the planes' program has them, which is a smaller program
    that grows less. The other options are as of `BilinearAlternationOptions`.
    """

    backoff_scale: float | None = None
    ellipsoid_margin_cost: EllipsoidMarginCost = EllipsoidMarginCost.SUM
    ellipsoid_margin_epsilon: float = 1e-5
    s_inner_pts: Sequence[Sequence[float]] = ()
    search_s_bounds_lagrangians: bool = True
    solver_id: str | None = None
    solver_options: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        """Raise CertificateError naming the option."""
        if not isinstance(self.ellipsoid_margin_cost, EllipsoidMarginCost):
            raise CertificateError(
                "ellipsoid_margin_cost must be an EllipsoidMarginCost, not"
                f" {quoted(self.ellipsoid_margin_cost)}"
            )
        if not 0.0 < _number(self.ellipsoid_margin_epsilon) < math.inf:
            raise CertificateError(
                "ellipsoid_margin_epsilon must be positive, not"
                f" {quoted(self.ellipsoid_margin_epsilon)}"
            )
        if self.backoff_scale is not None and not 0.0 <= _number(self.backoff_scale) < 1.0:
            raise CertificateError(
                f"backoff_scale must be None or in [0, 1), not {quoted(self.backoff_scale)}"
            )
        if type(self.search_s_bounds_lagrangians) is not bool:
            raise CertificateError(
                "search_s_bounds_lagrangians must be True or False, not"
                f" {quoted(self.search_s_bounds_lagrangians)}"
            )
        rule = "s_inner_pts must be numbers (m, nq)"
        points = real_array(self.s_inner_pts, rule, CertificateError)
        if points.ndim != 2 and points.shape != (0,):
            raise CertificateError(f"{rule}, not {quoted(self.s_inner_pts)}")
        object.__setattr__(self, "s_inner_pts", tuple(map(tuple, points.tolist())))
        _solver_of(self)

    @property
    def solver(self) -> SolverChoice | None:
        """The solver that is chosen, if one is."""
        return _solver_of(self)


@one_line()
@dataclass(frozen=True)
class BinarySearchOptions:
    """How a polytope is scaled about a point: between which factors, how often, how exactly.

    The search ends where the largest factor that was proven, and the smallest that was not, differ
    by ``convergence_tol``. Raises CertificateError for numbers that make no sense.
    """

    scale_min: float = 0.01
    scale_max: float = 1.0
    max_iter: int = 10
    convergence_tol: float = 1e-3
    find_lagrangian_options: FindSeparationCertificateOptions = field(
        default_factory=FindSeparationCertificateOptions
    )

    def __post_init__(self) -> None:
        """Raise CertificateError naming the option."""
        if not 0.0 < _number(self.scale_min) <= _number(self.scale_max) < math.inf:
            raise CertificateError(
                "scale_min and scale_max must be positive, in this order, not"
                f" {quoted(self.scale_min)} and {quoted(self.scale_max)}"
            )
        if not _number(self.convergence_tol) > 0.0:
            raise CertificateError(
                f"convergence_tol must be positive, not {quoted(self.convergence_tol)}"
            )
        _check_iterations(self.max_iter)
        _check_kind(self, "find_lagrangian_options", FindSeparationCertificateOptions)


@one_line()
@dataclass(frozen=True)
class BilinearAlternationOptions:
    """How a polytope is grown: for how many rounds, until the relative growth is small.

    ``convergence_tol`` is about the volume of the largest ellipsoid in the polytope; that
    ellipsoid, scaled by ``ellipsoid_scaling``, stays inside, as do ``s_inner_pts`` ``(m, nq)``,
    which must be inside at first. Faces move by ``ellipsoid_margin_cost``. These and more may be
    given together as ``find_polytope_options``, and those of the search for planes as
    ``find_lagrangian_options``. Raises CertificateError for numbers that make no sense, and for
    options given twice.
    """

    max_iter: int = 10
    convergence_tol: float = 1e-2
    ellipsoid_scaling: float = 0.99
    ellipsoid_margin_cost: EllipsoidMarginCost = EllipsoidMarginCost.SUM
    ellipsoid_margin_epsilon: float = 1e-5
    s_inner_pts: Sequence[Sequence[float]] = ()
    find_polytope_options: FindPolytopeGivenLagrangianOptions | None = None
    find_lagrangian_options: FindSeparationCertificateOptions = field(
        default_factory=FindSeparationCertificateOptions
    )

    def __post_init__(self) -> None:
        """Raise CertificateError naming the option."""
        _check_iterations(self.max_iter)
        _check_kind(self, "find_lagrangian_options", FindSeparationCertificateOptions)
        own = self._own_faces()
        object.__setattr__(self, "s_inner_pts", own.s_inner_pts)
        if self.find_polytope_options is not None:
            _check_kind(self, "find_polytope_options", FindPolytopeGivenLagrangianOptions)
            if own != FindPolytopeGivenLagrangianOptions():
                raise CertificateError(
                    "find_polytope_options has ellipsoid_margin_cost, ellipsoid_margin_epsilon and"
                    " s_inner_pts: give them there, or leave it out"
                )
        if not 0.0 <= _number(self.convergence_tol) < math.inf:
            raise CertificateError(
                f"convergence_tol must not be negative, not {quoted(self.convergence_tol)}"
            )
        if not 0.0 < _number(self.ellipsoid_scaling) <= 1.0:
            raise CertificateError(
                f"ellipsoid_scaling must be in (0, 1], not {quoted(self.ellipsoid_scaling)}"
            )

    @property
    def faces(self) -> FindPolytopeGivenLagrangianOptions:
        """The options of the faces' program, wherever they were given."""
        given = self.find_polytope_options
        return self._own_faces() if given is None else given

    def _own_faces(self) -> FindPolytopeGivenLagrangianOptions:
        return FindPolytopeGivenLagrangianOptions(
            ellipsoid_margin_cost=self.ellipsoid_margin_cost,
            ellipsoid_margin_epsilon=self.ellipsoid_margin_epsilon,
            s_inner_pts=self.s_inner_pts,
        )


def as_given_polytope(
    options: FindSeparationCertificateOptions | None,
) -> FindSeparationCertificateGivenPolytopeOptions:
    """Return options of a search in a polytope. Raises CertificateError for anything else."""
    given = as_search_options(options, FindSeparationCertificateOptions)
    if isinstance(given, FindSeparationCertificateGivenPolytopeOptions):
        return given
    return FindSeparationCertificateGivenPolytopeOptions(**vars(given))


def as_search_options(options: Any, kind: type[Options]) -> Options:
    """Return options of a kind, its defaults for None. Raises CertificateError."""
    given = kind() if options is None else options
    if not isinstance(given, kind):
        raise CertificateError(f"options must be {kind.__name__}, not {quoted(given)}")
    return given


def _number(value: object) -> float:
    """Return a number as a float; NaN, which is in no range, for anything else."""
    number = as_float(value)
    return math.nan if number is None else number


def _solver_of(options: Any) -> SolverChoice | None:
    """Return the solver that options name. Raises CertificateError."""
    try:
        known = {name: CONTINUOUS[name] for name in ("clarabel", "scs")}
        return as_choice(options.solver_id, options.solver_options, "solver_id", known)
    except ConvexSetError as error:
        raise CertificateError(str(error)) from error


def _check_kind(options: Any, name: str, kind: type) -> None:
    value = getattr(options, name)
    if not isinstance(value, kind):
        raise CertificateError(f"{name} must be {kind.__name__}, not {quoted(value)}")


def _check_iterations(max_iter: object) -> None:
    if type(max_iter) is not int or max_iter < 0:
        raise CertificateError(
            f"max_iter must be a whole number from 0 on, not {quoted(max_iter)}"
        )
