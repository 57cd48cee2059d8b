"""What cameras see of height fields: their surfaces, to rounding, as rays meet them."""

from camera_scenes import CLIPPING, LENS, WORLD
import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    HeightField,
    PerceptionProperties,
    ProximityProperties,
    QueryObject,
    SceneGraph,
)
from scene_graph_ros.geometry.perception import (
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)

DOWN = np.array([[1, 0, 0, 0.1], [0, -1, 0, -0.2], [0, 0, -1, 2.5], [0, 0, 0, 1.0]])


def test_pixels_projected_back_are_on_the_surface():
    """Also after other heights were set; what is seen is the field, by its label."""
    rng = np.random.default_rng(3)
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source = graph.register_source("map")
    instance = GeometryInstance(
        np.eye(4), HeightField(np.zeros((8, 9)), (1.5, 1.2), -0.5), "ground"
    )
    properties = PerceptionProperties()
    properties.add_property("label", "id", 7)
    instance.set_perception_properties(properties)
    instance.set_proximity_properties(ProximityProperties())
    field = graph.register_anchored_geometry(source, instance)
    context = graph.create_default_context()
    core = RenderCameraCore("exact", LENS, CLIPPING, np.eye(4))
    camera = DepthRenderCamera(core, DepthRange(0.1, 60.0))
    for heights in (None, rng.uniform(0.0, 0.8, (8, 9))):
        if heights is not None:
            context.set_heights(source, {field: heights})
        query = QueryObject(context)
        images = query.render_images(camera, WORLD, DOWN, kinds=("depth", "label"))
        depth, label = np.asarray(images.depth), np.asarray(images.label)
        seen = np.isfinite(depth)
        assert seen.sum() > 50
        assert (label[seen] == 7).all()
        v, u = np.nonzero(seen)
        rays = np.column_stack([(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, np.ones(len(u))])
        p_W = (rays * depth[seen][:, np.newaxis]) @ DOWN[:3, :3].T + DOWN[:3, 3]
        distances = query.compute_signed_distance_to_points(p_W[:: max(len(p_W) // 500, 1)])
        assert np.abs(distances.distance).max() < 1e-6  # of a float32
