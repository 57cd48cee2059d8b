"""A polyhedron as an intersection of half-spaces, in any number of dimensions."""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from typing import Any, Literal, overload

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.affine_transformation import largest_image
from scene_graph_ros.convex.questions.arguments import (
    as_corners_dimension,
    as_nonnegative,
    as_vector,
    as_whole,
)
from scene_graph_ros.convex.questions.certificates import Decision
from scene_graph_ros.convex.questions.ellipsoids import inscribed
from scene_graph_ros.convex.questions.quick_answers import (
    center_of_rows,
    is_contained,
    redundant,
)
from scene_graph_ros.convex.questions.redundancy import (
    checked_tolerance,
    contained_in,
    implied_rows,
    reduce_rows,
    Reduction,
)
from scene_graph_ros.convex.questions.simplification import (
    Simplification,
    simplified,
)
from scene_graph_ros.convex.sets.affine_ball import AffineBall
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.given_rows import rows_of
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.row_set import RowSet
from scene_graph_ros.convex.solve.exact.feasibility import find_deepest
from scene_graph_ros.convex.volumes.sampling import draw, draw_many, UniformSamples
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["HPolyhedron"]

_NOTHING = np.zeros((0, 0))

_MOST_DIMENSIONS = 10_000
"""Of which a square matrix still fits in memory."""


class HPolyhedron(RowSet):
    """All x with ``A x <= b``: ``A (m, n)``, ``b (m,)``. It may be unbounded, flat or empty.

    ``HPolyhedron(v_polytope)`` has the faces of a hull of points,
    ``HPolyhedron(query, geometry_id, reference_frame=None)`` those of a registered box, half
    space, hull or convex mesh, in a frame, the world by default; ``HPolyhedron(program)`` is the
    feasible set of a `ConicProgram` of linear rows, in all its variables.
    """

    def __init__(
        self,
        A: Any = _NOTHING,
        b: Any = (),
        reference_frame: FrameId | None = None,
    ) -> None:
        """Take rows, vertices or a geometry. Raises ConvexSetError unless A and b fit."""
        if type(A) is not np.ndarray:
            A, b = rows_of(A, b, reference_frame)
        super().__init__(A, b)

    @classmethod
    def make_box(cls, lb: Any, ub: Any) -> HPolyhedron:
        """Return the box between two corners ``(n,)``: upper faces, then lower ones."""
        low = as_vector(lb, "HPolyhedron.make_box: lb")
        high = as_vector(ub, "HPolyhedron.make_box: ub", len(low))
        return cls(np.concatenate([np.eye(len(low)), -np.eye(len(low))]), np.append(high, -low))

    @classmethod
    def make_unit_box(cls, dim: int) -> HPolyhedron:
        """Return the box from -1 to 1 along each axis."""
        n = as_whole(dim, "HPolyhedron.make_unit_box: dim", 0, _MOST_DIMENSIONS)
        return cls.make_box(-np.ones(n), np.ones(n))

    @classmethod
    def make_l1_ball(cls, dim: int) -> HPolyhedron:
        """Return the cross-polytope: all points whose coordinates' magnitudes add up to 1."""
        n = as_corners_dimension(dim, "HPolyhedron.make_l1_ball: dim")
        signs = np.array(list(itertools.product([-1.0, 1.0], repeat=n))).reshape(2**n, n)
        return cls(signs, np.ones(len(signs)))

    def cartesian_product(self, other: HPolyhedron) -> HPolyhedron:
        """Return all (x, y) with x in this polyhedron and y in the other."""
        if not isinstance(other, HPolyhedron):
            raise ConvexSetError(
                f"HPolyhedron.cartesian_product: other must be an HPolyhedron, not {quoted(other)}"
            )
        A = np.zeros(
            (len(self._b) + len(other.b), self.ambient_dimension + other.ambient_dimension)
        )
        A[: len(self._b), : self.ambient_dimension] = self._A
        A[len(self._b) :, self.ambient_dimension :] = other.A
        return HPolyhedron(A, np.append(self._b, other.b))

    def cartesian_power(self, n: int) -> HPolyhedron:
        """Return the product of n times this polyhedron, n at least 1."""
        times = as_whole(n, "HPolyhedron.cartesian_power: n", 1, _MOST_DIMENSIONS)
        return HPolyhedron(np.kron(np.eye(times), self._A), np.tile(self._b, times))

    def chebyshev_center(self) -> np.ndarray:
        """Return the centre ``(n,)`` of a largest ball inside.

        Raises ConvexSetError for an empty set, and where balls can be as large as one likes.
        """
        center = center_of_rows(self._A, self._b)
        if center is not None:
            return center
        if self.is_empty():
            raise ConvexSetError("HPolyhedron.chebyshev_center: the set is empty")
        deepest = find_deepest(self._lift.rows)
        if deepest.radius >= deepest.cap and self.ambient_dimension:
            raise ConvexSetError(
                f"HPolyhedron.chebyshev_center: balls of radius {deepest.cap:g} and more fit in;"
                " intersect the set with a box"
            )
        return deepest.x

    @overload
    def contained_in(
        self, other: HPolyhedron, tol: float = ..., *, certificate: Literal[False] = ...
    ) -> bool: ...

    @overload
    def contained_in(
        self, other: HPolyhedron, tol: float = ..., *, certificate: Literal[True]
    ) -> Decision: ...

    def contained_in(
        self, other: HPolyhedron, tol: float = 1e-9, *, certificate: bool = False
    ) -> bool | Decision:
        """Tell whether all points are in another polyhedron whose faces are moved out by ``tol``.

        ``tol`` is a distance, which may be negative. The certificate is ``multipliers``,
        ``farkas`` for an empty set, or a ``point`` that is outside.
        """
        self._check_other(other, "contained_in", HPolyhedron)
        quick = None if certificate else is_contained(self, other, checked_tolerance(tol))
        if quick is not None:
            return quick
        decision = contained_in(self, other, tol)
        return decision if certificate else decision.value

    def find_redundant(self, tol: float = 1e-9) -> set[int]:
        """Return rows that can all be left out: the others imply them, moved out by ``tol``."""
        quick = redundant(self._A, self._b, checked_tolerance(tol, "find_redundant"))
        if quick is not None:
            return set(np.flatnonzero(quick).tolist())
        return set(reduce_rows(self, tol).removed)

    @overload
    def reduce_inequalities(
        self, tol: float = ..., *, certificate: Literal[False] = ...
    ) -> HPolyhedron: ...

    @overload
    def reduce_inequalities(
        self, tol: float = ..., *, certificate: Literal[True]
    ) -> tuple[HPolyhedron, Reduction]: ...

    def reduce_inequalities(
        self, tol: float = 1e-9, *, certificate: bool = False
    ) -> HPolyhedron | tuple[HPolyhedron, Reduction]:
        """Return the polyhedron without the rows of `find_redundant`; with proofs on request."""
        if not certificate:
            left_out = redundant(self._A, self._b, checked_tolerance(tol, "reduce_inequalities"))
            if left_out is not None:
                return HPolyhedron(self._A[~left_out], self._b[~left_out])
        reduction = reduce_rows(self, tol)
        kept = [i for i in range(len(self._b)) if i not in reduction.removed]
        reduced = HPolyhedron(self._A[kept], self._b[kept])
        return (reduced, reduction) if certificate else reduced

    def intersection(
        self, other: HPolyhedron, check_for_redundancy: bool = False, tol: float = 1e-9
    ) -> HPolyhedron:
        """Return the polyhedron with the rows of both; on request without new ones it implies."""
        self._check_other(other, "intersection", HPolyhedron)
        kept = np.arange(len(other.b))
        if check_for_redundancy:
            kept = np.setdiff1d(kept, implied_rows(self, other, tol))
        return HPolyhedron(
            np.concatenate([self._A, other.A[kept]]), np.append(self._b, other.b[kept])
        )

    def maximum_volume_inscribed_ellipsoid(self) -> Hyperellipsoid:
        """Return the largest ellipsoid inside, without tolerance.

        Its log volume is within 1e-9 for each dimension of the largest. Raises ConvexSetError for
        a set that is empty, flat or unbounded, SolverError where the bound is not reached.
        """
        found = inscribed(self)
        return Hyperellipsoid(AffineBall(found.B, found.center))

    def maximum_volume_inscribed_affine_transformation(
        self, circumbody: HPolyhedron
    ) -> HPolyhedron:
        """Return ``T x + t`` of all points, with T symmetric, semidefinite, of the largest volume.

        Inside ``circumbody`` without tolerance; T is as the solver of cone programs finds it, the
        volume's logarithm to about 1e-7. Raises ConvexSetError for a set that is empty, unbounded
        or flat, SolverError where nothing was found.
        """
        question = "maximum_volume_inscribed_affine_transformation"
        self._check_other(circumbody, question, HPolyhedron)
        T, t = largest_image(self, circumbody)
        A = self._A @ np.linalg.inv(T)
        return HPolyhedron(A, self._b + A @ t)

    def simplify_by_incremental_face_translation(
        self,
        min_volume_ratio: float = 0.1,
        do_affine_transformation: bool = True,
        max_iterations: int = 10,
        points_to_contain: Any = None,
        intersecting_polytopes: Sequence[HPolyhedron] = (),
        keep_whole_intersection: bool = False,
        intersection_padding: float = 1e-4,
        random_seed: int = 0,
    ) -> HPolyhedron:
        """Return a polyhedron inside this one, with fewer faces.

        Faces in random order move in, as far as ``min_volume_ratio`` of the volume, the points
        ``(m, n)`` and the polytopes allow; where others then follow from those that stay they are
        left out, and the face moves back as far as it may. That ends after ``max_iterations``, or
        when no more faces go. With ``do_affine_transformation`` the largest affine image inside
        this set is returned, if it keeps points and polytopes.

        Each of ``intersecting_polytopes`` still meets the result, by ``intersection_padding``
        beyond the face where there is room; with ``keep_whole_intersection`` moving faces take
        nothing of their intersection. Raises ConvexSetError for a set that is empty or
        unbounded, points outside and polytopes that don't meet it.
        """
        return simplified(
            self,
            Simplification(
                min_volume_ratio,
                do_affine_transformation,
                max_iterations,
                points_to_contain,
                intersecting_polytopes,
                keep_whole_intersection,
                intersection_padding,
                random_seed,
            ),
        )

    def pontryagin_difference(self, other: ConvexSet) -> HPolyhedron:
        """Return all a for which ``a + other`` is inside. Raises ConvexSetError if unbounded."""
        self._check_other(other, "pontryagin_difference")
        for name, each in (("the set", self), ("other", other)):
            if each.is_empty() or not each.is_bounded():
                raise ConvexSetError(
                    f"HPolyhedron.pontryagin_difference: {name} must be bounded and have a point"
                )
        reached = [other.support(row) for row in self._A]
        return HPolyhedron(self._A, self._b - [r.value + r.gap for r in reached])

    def scale(self, scale: float, center: Any = None) -> HPolyhedron:
        """Return the polyhedron scaled about a point, its Chebyshev centre by default.

        ``scale`` is that of the volume: distances grow by its n-th root.
        """
        factor = as_nonnegative(scale, "HPolyhedron.scale: scale")
        if not self.ambient_dimension:
            return self
        about = (
            self.chebyshev_center()
            if center is None
            else as_vector(center, "HPolyhedron.scale: center", self.ambient_dimension)
        )
        at = self._A @ about
        return HPolyhedron(self._A, at + factor ** (1.0 / self.ambient_dimension) * (self._b - at))

    def uniform_sample(
        self,
        generator: np.random.Generator,
        previous_sample: Any = None,
        mixing_steps: int = 10,
        *,
        subspace: Any = None,
        tol: float = 1e-8,
    ) -> np.ndarray:
        """Draw a point ``(n,)``, nearly uniformly: ``mixing_steps`` of hit and run from another.

        Without ``previous_sample (n,)`` from the Chebyshev centre. With ``subspace (n, k)``,
        orthonormal columns, all steps are along it; rows that it changes by no more than ``tol``
        don't count. Raises ConvexSetError unless the start is inside and the set bounded.
        """
        return draw(self, generator, previous_sample, mixing_steps, subspace, tol)

    def uniform_samples(
        self,
        generator: np.random.Generator,
        num_samples: int,
        *,
        mixing_steps: int | None = None,
        num_chains: int = 64,
    ) -> UniformSamples:
        """Draw many points, nearly uniformly, with an effective sample size.

        Chains begin uniformly in the largest ellipsoid inside, and walk along axes of coordinates
        in which that is a ball (Smith 1984), ``mixing_steps`` between two points, by default 4 n.
        Raises ConvexSetError for a set that is empty, flat or unbounded.
        """
        return draw_many(self, generator, num_samples, mixing_steps, num_chains)
