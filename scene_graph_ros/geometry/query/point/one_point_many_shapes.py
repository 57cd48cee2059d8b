"""Signed distances of one point after another to all rows: shapes of one kind in step.

There are as many of them at a time as there are lanes; hulls of many corners are one by one.
"""

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.answers import write_answer
from scene_graph_ros.geometry.query.point.closed_forms import CLOSED_FORMS
from scene_graph_ros.geometry.query.point.ellipsoid_lanes import answer_ellipsoids
from scene_graph_ros.geometry.query.point.hull_lanes import answer_hulls
from scene_graph_ros.geometry.query.point.kind_table import borrowed
from scene_graph_ros.geometry.query.point.lane_memory import lane_numbers, LANES
from scene_graph_ros.geometry.query.point.lanes import (
    enter_frames,
    leave_frames,
    question,
    read_lane,
    set_answer,
    take_poses,
)
from scene_graph_ros.geometry.query.point.point_convex import point_hull
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    rotate_inverse,
    subtract,
)

__all__ = ["answer_few_points"]

_CONVEX = int(ShapeKind.CONVEX)
_ELLIPSOID = int(ShapeKind.ELLIPSOID)


def _in_lanes(point_shape):
    """Return a kernel that answers all lanes with a closed form."""

    @lean_kernel
    def answer(lanes):
        use_widest_vectors()
        for j in range(LANES):
            size, p_GQ = question(lanes, j)
            set_answer(lanes, j, point_shape(size, p_GQ))

    return answer


@by_kind(lean_kernel, ["kind"], {kind: _in_lanes(form) for kind, form in CLOSED_FORMS.items()})
def _answer_closed_form(lanes, kind):
    """Answer all lanes, all about shapes of one kind with a closed form."""


@inlined_kernel
def _answer_tile(kinds, tile, lanes):
    """Answer all lanes about the shapes of a tile."""
    k = kinds.tile_hulls[tile]
    kind = kinds.kind[kinds.tile_rows[tile, 0]]
    if kind == _ELLIPSOID:
        answer_ellipsoids(lanes)
    elif kind != _CONVEX:
        _answer_closed_form(lanes, kind)
    else:
        answer_hulls(
            lanes, kinds.corners, k, kinds.corner_count[k],
            kinds.blocks, kinds.block, kinds.tile_rows, tile,
        )  # fmt: skip


@lean_kernel
def _answer_tiles(kinds, X_WG, p_WQs, first, last, columns):
    """Answer points first to last about all rows in tiles."""
    n = X_WG.shape[0]
    lanes, poses = lane_numbers(), lane_numbers()
    for tile in range(kinds.tile_rows.shape[0]):
        take_poses(X_WG, kinds.tile_rows, tile, poses)
        for q in range(first, last):
            enter_frames(lanes, kinds.tile_sizes, tile, poses, load_vector(p_WQs, q))
            _answer_tile(kinds, tile, lanes)
            leave_frames(lanes, poses)
            for j in range(LANES):
                phi, nearest, gradient, unique = read_lane(lanes, j)
                write_answer(
                    columns, q * n + kinds.tile_rows[tile, j], phi, nearest, gradient, unique
                )


@lean_kernel
def _answer_large_hulls(kinds, X_WG, p_WQs, first, last, columns):
    n = X_WG.shape[0]
    for slot in range(kinds.large_hulls.shape[0]):
        i = kinds.large_hulls[slot]
        R_WG, p_WG = load_rotation(X_WG, i), load_translation(X_WG, i)
        for q in range(first, last):
            p_GQ = rotate_inverse(R_WG, subtract(load_vector(p_WQs, q), p_WG))
            phi, nearest, gradient, unique = point_hull(
                kinds.blocks, kinds.block[i], kinds.size[i, 0], p_GQ
            )
            write_answer(columns, q * n + i, phi, nearest, rotate(R_WG, gradient), unique)


@lean_kernel
def answer_few_points(places, X_WG, p_WQs, first, last, columns):
    """Answer points first to last about all rows but meshes.

    ``places`` are those of ``hold_kinds``; the columns those of ``answer_all``.
    """
    kinds = borrowed(places)
    _answer_tiles(kinds, X_WG, p_WQs, first, last, columns)
    _answer_large_hulls(kinds, X_WG, p_WQs, first, last, columns)
