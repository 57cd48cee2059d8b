"""Many points against one shape with a closed form, from the world and back, in one loop.

Nothing is kept in between, so that most of it happens in the processor's registers. The arithmetic
is that of ``lanes``.
"""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes import keep_answer, p_GQ_of_lane
from scene_graph_ros.geometry.query.point.point_box import point_box
from scene_graph_ros.geometry.query.point.point_capsule import point_capsule
from scene_graph_ros.geometry.query.point.point_cylinder import point_cylinder
from scene_graph_ros.geometry.query.point.point_half_space import point_half_space
from scene_graph_ros.geometry.query.point.point_sphere import point_sphere
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["answer_shape"]

_SPHERE = int(ShapeKind.SPHERE)
_CAPSULE = int(ShapeKind.CAPSULE)
_BOX = int(ShapeKind.BOX)
_CYLINDER = int(ShapeKind.CYLINDER)
_HALF_SPACE = int(ShapeKind.HALF_SPACE)


@lean_kernel
def _sphere(points, size, R_WG, p_WG, answers, first):
    use_widest_vectors()
    first &= LAST_PLACE
    for j in range(LANES):
        p_GQ = p_GQ_of_lane(points, j, R_WG, p_WG)
        keep_answer(answers, first, j, R_WG, point_sphere(size, p_GQ))


@lean_kernel
def _capsule(points, size, R_WG, p_WG, answers, first):
    use_widest_vectors()
    first &= LAST_PLACE
    for j in range(LANES):
        p_GQ = p_GQ_of_lane(points, j, R_WG, p_WG)
        keep_answer(answers, first, j, R_WG, point_capsule(size, p_GQ))


@lean_kernel
def _box(points, size, R_WG, p_WG, answers, first):
    use_widest_vectors()
    first &= LAST_PLACE
    for j in range(LANES):
        p_GQ = p_GQ_of_lane(points, j, R_WG, p_WG)
        keep_answer(answers, first, j, R_WG, point_box(size, p_GQ))


@lean_kernel
def _cylinder(points, size, R_WG, p_WG, answers, first):
    use_widest_vectors()
    first &= LAST_PLACE
    for j in range(LANES):
        p_GQ = p_GQ_of_lane(points, j, R_WG, p_WG)
        keep_answer(answers, first, j, R_WG, point_cylinder(size, p_GQ))


@lean_kernel
def _half_space(points, size, R_WG, p_WG, answers, first):
    use_widest_vectors()
    first &= LAST_PLACE
    for j in range(LANES):
        p_GQ = p_GQ_of_lane(points, j, R_WG, p_WG)
        keep_answer(answers, first, j, R_WG, point_half_space(p_GQ))


@lean_kernel
def answer_shape(kind, size, R_WG, p_WG, points, answers, first):
    """Write all lanes' answers about one shape from ``answers[first]`` on, as ``keep_answers``.

    ``points`` are p_WQ, the first triple of each lane. Other kinds than those with a closed form
    have no answer.
    """
    if kind == _SPHERE:
        _sphere(points, size, R_WG, p_WG, answers, first)
    elif kind == _CAPSULE:
        _capsule(points, size, R_WG, p_WG, answers, first)
    elif kind == _BOX:
        _box(points, size, R_WG, p_WG, answers, first)
    elif kind == _CYLINDER:
        _cylinder(points, size, R_WG, p_WG, answers, first)
    elif kind == _HALF_SPACE:
        _half_space(points, size, R_WG, p_WG, answers, first)
