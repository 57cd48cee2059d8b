"""Query objects follow their context until they are baked."""

import numpy as np
import pytest

from scene_graph_ros.geometry import QueryObject


def test_live_query_sees_poses_and_model_of_now(world):
    """One query object, asked before and after a move and a removal."""
    graph = world.scene_graph
    context = graph.create_default_context()
    query = graph.query_object(context)
    assert isinstance(query, QueryObject)
    assert query.get_pose_in_world(world.crate)[0, 3] == 0.0
    context.set_frame_pose(world.other, world.box_frame, world.translation(x=2.0))
    assert query.get_pose_in_world(world.crate)[0, 3] == 2.0
    graph.remove_geometry(world.arm, world.ball1, context=context)
    assert query.inspector().num_geometries() == 3


def test_baked_query_stays(world):
    """What was baked answers the same whatever happens to the context; baking again is free."""
    graph = world.scene_graph
    context = graph.create_default_context()
    context.set_frame_pose(world.other, world.box_frame, world.translation(x=1.0))
    baked = graph.query_object(context).bake()
    context.set_frame_poses(world.other, np.array([world.translation(x=2.0)]))
    graph.remove_source(world.arm, context=context)
    assert baked.get_pose_in_world(world.crate)[0, 3] == 1.0
    assert baked.get_pose_in_parent(world.box_frame)[0, 3] == 1.0
    assert baked.inspector().num_geometries() == 4
    assert baked.bake().snapshot is baked.snapshot


def test_query_object_needs_a_context(world):
    """Anything else than a context is refused."""
    for other in (world.scene_graph, None):
        with pytest.raises(TypeError, match="create_default_context"):
            world.scene_graph.query_object(other)
