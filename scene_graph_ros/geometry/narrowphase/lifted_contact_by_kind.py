"""``lifted_contact`` compiled for each pair of kinds of cores, since most of its time is choice.

With the kinds known, the code of a core's support point, features and curvatures are is known when
the code is compiled, and all of it is merged into one function: that takes a third of the time of
calls which find out again and again about kinds.
"""

from typing import Any

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel, merged_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    SEGMENT,
)
from scene_graph_ros.geometry.narrowphase.lifted_contact import lifted_contact, NO_ANSWER
from scene_graph_ros.geometry.narrowphase.pair import Pair

__all__ = ["OF_KINDS", "lifted_contact_by_kind"]

PAIRS = (
    (SEGMENT, CYLINDER),
    (SEGMENT, ELLIPSOID),
    (SEGMENT, HULL),
    (BOX, CYLINDER),
    (BOX, ELLIPSOID),
    (BOX, HULL),
    (CYLINDER, CYLINDER),
    (CYLINDER, ELLIPSOID),
    (CYLINDER, HULL),
    (ELLIPSOID, ELLIPSOID),
    (ELLIPSOID, HULL),
    (HULL, HULL),
)
"""Kinds in the order of ``ShapeKind``. Points are not there: they have closed forms."""


def _compiled_for(kind_A: int, kind_B: int) -> Any:
    @lean_kernel
    def lifted_contact_of_kinds(pair, limit, work):
        core_A, core_B, R, p, hulls = pair
        core_A = (kind_A, core_A[1], core_A[2], core_A[3])
        core_B = (kind_B, core_B[1], core_B[2], core_B[3])
        return lifted_contact(Pair(core_A, core_B, R, p, hulls), limit, work)

    return lifted_contact_of_kinds


OF_KINDS = {kinds: _compiled_for(*kinds) for kinds in PAIRS}
"""``lifted_contact`` by kinds."""


@inlined_kernel
def _untried(pair, limit, work):
    return NO_ANSWER


@by_kind(
    merged_kernel,
    ["pair.core_A[0]", "pair.core_B[0]"],
    OF_KINDS,
    otherwise=_untried,
)
def lifted_contact_by_kind(pair, limit, work):
    """Return the answer of ``lifted_contact`` for kinds in order, ``OPEN`` for others."""
