"""``lifted_contact`` compiled for each pair of kinds of cores, since most of its time is choice.

With the kinds known, what a core's support point, features and curvatures are is known when the
code is compiled, and all of it is merged into one function: that takes a third of the time of
calls which find out again and again what they have to do.
"""

from typing import Any

from scene_graph_ros.geometry.compiled.kernel import lean_kernel, merged_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    SEGMENT,
)
from scene_graph_ros.geometry.narrowphase.lift import lifted_contact, NO_ANSWER

__all__ = ["lifted_contact_by_kind"]


def _compiled_for(kind_A: int, kind_B: int) -> Any:
    @lean_kernel
    def lifted_contact_of_kinds(core_A, core_B, R, p, hulls, limit, S, ids, lam):
        return lifted_contact(
            (kind_A, core_A[1], core_A[2], core_A[3]),
            (kind_B, core_B[1], core_B[2], core_B[3]),
            R,
            p,
            hulls,
            limit,
            S,
            ids,
            lam,
        )

    return lifted_contact_of_kinds


_segment_cylinder = _compiled_for(SEGMENT, CYLINDER)
_segment_ellipsoid = _compiled_for(SEGMENT, ELLIPSOID)
_segment_hull = _compiled_for(SEGMENT, HULL)
_box_cylinder = _compiled_for(BOX, CYLINDER)
_box_ellipsoid = _compiled_for(BOX, ELLIPSOID)
_box_hull = _compiled_for(BOX, HULL)
_cylinder_cylinder = _compiled_for(CYLINDER, CYLINDER)
_cylinder_ellipsoid = _compiled_for(CYLINDER, ELLIPSOID)
_cylinder_hull = _compiled_for(CYLINDER, HULL)
_ellipsoid_ellipsoid = _compiled_for(ELLIPSOID, ELLIPSOID)
_ellipsoid_hull = _compiled_for(ELLIPSOID, HULL)
_hull_hull = _compiled_for(HULL, HULL)


@merged_kernel
def _with_segment(core_A, core_B, R, p, hulls, limit, S, ids, lam):
    if core_B[0] == CYLINDER:
        return _segment_cylinder(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if core_B[0] == ELLIPSOID:
        return _segment_ellipsoid(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if core_B[0] == HULL:
        return _segment_hull(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    return NO_ANSWER


@merged_kernel
def _with_box(core_A, core_B, R, p, hulls, limit, S, ids, lam):
    if core_B[0] == CYLINDER:
        return _box_cylinder(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if core_B[0] == ELLIPSOID:
        return _box_ellipsoid(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if core_B[0] == HULL:
        return _box_hull(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    return NO_ANSWER


@merged_kernel
def _with_cylinder(core_A, core_B, R, p, hulls, limit, S, ids, lam):
    if core_B[0] == CYLINDER:
        return _cylinder_cylinder(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if core_B[0] == ELLIPSOID:
        return _cylinder_ellipsoid(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if core_B[0] == HULL:
        return _cylinder_hull(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    return NO_ANSWER


@merged_kernel
def lifted_contact_by_kind(core_A, core_B, R, p, hulls, limit, S, ids, lam):
    """Return what ``lifted_contact`` does for kinds in order, ``OPEN`` for others.

    The order is that of ``ShapeKind``. Points are not there: they have closed forms.
    """
    kind = core_A[0]
    if kind == SEGMENT:
        return _with_segment(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if kind == BOX:
        return _with_box(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if kind == CYLINDER:
        return _with_cylinder(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if kind == ELLIPSOID and core_B[0] == ELLIPSOID:
        return _ellipsoid_ellipsoid(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if kind == ELLIPSOID and core_B[0] == HULL:
        return _ellipsoid_hull(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    if kind == HULL and core_B[0] == HULL:
        return _hull_hull(core_A, core_B, R, p, hulls, limit, S, ids, lam)
    return NO_ANSWER
