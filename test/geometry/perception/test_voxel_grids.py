"""What cameras see of voxel grids: the faces of their solid voxels."""

from camera_scenes import CLIPPING, LENS, WORLD
import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    PerceptionProperties,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    VoxelGrid,
)
from scene_graph_ros.geometry.perception import (
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)

DOWN = np.array([[1, 0, 0, 0.5], [0, -1, 0, 0.4], [0, 0, -1, 2.5], [0, 0, 0, 1.0]])


def test_pixels_projected_back_are_on_solid_voxels():
    """Also after others were set; of a grid in which nothing is solid nothing is seen."""
    rng = np.random.default_rng(3)
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source = graph.register_source("map")
    instance = GeometryInstance(np.eye(4), VoxelGrid([[[0]]], 0.1), "map")
    instance.set_perception_properties(PerceptionProperties())
    instance.set_proximity_properties(ProximityProperties())
    grid = graph.register_anchored_geometry(source, instance)
    context = graph.create_default_context()
    camera = DepthRenderCamera(
        RenderCameraCore("exact", LENS, CLIPPING, np.eye(4)), DepthRange(0.1, 60.0)
    )
    for part in (0.0, 0.3):
        context.set_voxels(source, {grid: (rng.random((10, 9, 6)) < part).astype(int)})
        query = QueryObject(context)
        images = query.render_images(camera, WORLD, DOWN, kinds=("depth",))
        depth = np.asarray(images.depth)
        seen = np.isfinite(depth)
        assert seen.any() == (part > 0.0)
        if part > 0.0:
            v, u = np.nonzero(seen)
            rays = np.column_stack(
                [(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, np.ones(len(u))]
            )
            p_W = (rays * depth[seen][:, np.newaxis]) @ DOWN[:3, :3].T + DOWN[:3, 3]
            distances = query.compute_signed_distance_to_points(p_W[::7]).distance
            assert np.abs(distances).max() < 1e-6  # of a float32
