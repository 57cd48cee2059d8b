"""A question that is interrupted anywhere changes no answer, of its own or another's."""

from functools import partial

from camera_scenes import CLIPPING, LENS
from edited_worlds import answers_of, at, World
from interrupting import instruction_count, interrupted_at, places
import numpy as np
from plain_values import plain
from public_changes import uncalled_methods
import pytest
from world_edits import EDITS, EDITS_OF_POSES

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    CollisionFilterDeclaration,
    GeometrySet,
    ProximityProperties,
    QueryObject,
    Role,
    RoleAssign,
)
from scene_graph_ros.geometry.perception import (
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)

CORE = RenderCameraCore("camera", LENS, CLIPPING, np.eye(4))
COLOR = ColorRenderCamera(CORE, False)
DEPTH = DepthRenderCamera(CORE, DepthRange(0.01, 9.0))
ABOVE = np.diag([1.0, -1, -1, 1]) + 2.5 * np.eye(4, k=1)[[3, 3, 2, 3]]
SAMPLE = 5


def prepare(world, *, alone=False):
    """Give a world bodies that press each other, or these ``alone``, and a camera's renderer."""
    graph, to = world.graph, world.target
    soft, stiff = ProximityProperties(), ProximityProperties()
    add_compliant_hydroelastic_properties(soft, 1.0, 1e5)
    add_rigid_hydroelastic_properties(stiff, 1.0)
    graph.assign_role(world.arm, world.ids["ball"], soft, RoleAssign.REPLACE, context=to)
    graph.assign_role(world.other, world.ids["box"], stiff, RoleAssign.REPLACE, context=to)
    EDITS["assign perception"](world)
    graph.add_renderer("camera", ExactRenderEngine(), context=to)
    if alone:
        declaration = CollisionFilterDeclaration()
        declaration.exclude_within(GeometrySet(list(world.ids.values())))
        declaration.allow_between(world.set_of("ball"), world.set_of("box"))
        graph.collision_filter_manager(to).apply(declaration)


@pytest.fixture(scope="module", name="made")
def _made():
    """Return what makes a world in which poses and shapes have changed since it was asked."""
    firsts = {k: World(own=True, prepare=partial(prepare, alone=k)) for k in (False, True)}

    def made(name):
        world = firsts[name == "surfaces alone"].copy()
        EDITS_OF_POSES["set all poses"](world)
        EDITS_OF_POSES["set configurations"](world)
        EDITS["change shape"](world)
        return world

    return made


def at_two_poses(world):
    """Return what would be if a frame were elsewhere."""
    poses = [{world.frames["tool"]: at(0.1 * k, 0, 0)} for k in range(2)]
    return world.query.ask_what_if(poses, QueryObject.compute_point_pair_penetration)


def rendered(how, camera):
    """Return what asks for an image from above."""
    return lambda w: getattr(w.query, how)(camera, w.graph.world_frame_id(), ABOVE)


QUESTIONS = {
    "all": answers_of,
    "snapshot": lambda w: w.query.snapshot.X_WG,
    "bake": lambda w: w.query.bake().compute_point_pair_penetration(),
    "accuracy": lambda w: str(w.query.accuracy),
    "engine": lambda w: str(w.query.engine),
    "with_unknown_voxels": lambda w: w.query.with_unknown_voxels(
        is_free=True
    ).compute_point_pair_penetration(),
    "inspector": lambda w: w.query.inspector().get_collision_candidates(),
    "pose": lambda w: w.query.get_pose_in_world(w.frames["link2"]),
    "pose in parent": lambda w: w.query.get_pose_in_parent(w.frames["link2"]),
    "configuration": lambda w: w.query.get_configurations_in_world(w.ids["pad"]),
    "driven": lambda w: w.query.get_driven_mesh_configurations_in_world(
        w.ids["pad"], Role.PROXIMITY
    ),
    "what if": at_two_poses,
    "candidates": lambda w: w.query.find_collision_candidates(),
    "collisions": lambda w: w.query.has_collisions(),
    "depth": lambda w: w.query.compute_point_pair_penetration(),
    "depth and derivatives": lambda w: w.query.compute_point_pair_penetration(
        derivatives=True, certificate=True
    ),
    "surfaces": lambda w: w.query.compute_contact_surfaces_with_fallback(),
    "surfaces alone": lambda w: w.query.compute_contact_surfaces("polygon"),
    "deformable": lambda w: w.query.compute_deformable_contact(),
    "distance": lambda w: w.query.compute_signed_distance_pairwise_closest_points(
        max_distance=0.3
    ),
    "distance of a pair": lambda w: w.query.compute_signed_distance_pair_closest_points(
        w.ids["ball"], w.ids["egg"]
    ),
    "box": lambda w: [each.tolist() for each in w.query.compute_aabb_in_world(w.ids["egg"])],
    "point of some": lambda w: w.query.compute_signed_distance_geometry_to_point(
        [0.1, 0.2, 0.3], w.set_of("ball", "egg")
    ),
    "point": lambda w: w.query.compute_signed_distance_to_point([0.1, 0.2, 0.3]),
    "points": lambda w: w.query.compute_signed_distance_to_points(np.ones((2, 3)), threads=2),
    "colour": rendered("render_color_image", COLOR),
    "depth image": rendered("render_depth_image", DEPTH),
    "labels": rendered("render_label_image", COLOR),
    "images": rendered("render_images", DEPTH),
    "renderer": lambda w: type(w.query.get_render_engine_by_name("camera")).__name__,
}


def test_each_public_question_is_tried(made):
    """A new query has to be among the questions."""
    actions = [partial(ask, made(name)) for name, ask in QUESTIONS.items()]
    assert uncalled_methods(QueryObject, (), actions) == set()


@pytest.mark.search
@pytest.mark.parametrize("name", QUESTIONS)
def test_an_interrupted_question_changes_no_answer(made, name):
    """Poses and shapes have changed before it, so that much is to be computed and remembered."""
    world, ask = made(name), QUESTIONS[name]
    expected, answer = answers_of(made(name)), plain(ask(made(name)))
    assert answer
    count = instruction_count(lambda: ask(world))
    for k in places(count, name, SAMPLE):
        world = made(name)
        interrupted_at(lambda world=world: ask(world), k)
        assert plain(ask(world)) == answer, k
        assert answers_of(world) == expected, k
        world.context.set_frame_poses(world.arm, world.poses(1.0))
        world.context.set_frame_poses(world.arm, world.poses(0.03))
        assert plain(ask(world)) == answer, k
