"""What cameras see of clouds: their balls, as spheres of their own would be seen."""

from camera_scenes import CLIPPING, LENS, WORLD
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryInstance,
    PerceptionProperties,
    PointCloud,
    QueryObject,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import (
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)

POINTS = np.array([[0.3, 0.0, 2.0], [-0.3, 0.1, 3.0], [0.0, -0.2, 1.5], [0.0, 0.0, -2.0]])
X_WB = np.eye(4)


def context_of(shapes, *, alpha=1.0):
    """Return a scene graph, its source, its geometries and a context of it."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source, ids = graph.register_source("camera"), []
    for k, (shape, center) in enumerate(shapes):
        X = np.eye(4)
        X[:3, 3] = center
        instance = GeometryInstance(X, shape, f"seen_{k}")
        properties = PerceptionProperties()
        properties.add_property("phong", "diffuse", (0.5, 0.25, 1.0, alpha))
        properties.add_property("label", "id", 7)
        instance.set_perception_properties(properties)
        ids.append(graph.register_anchored_geometry(source, instance))
    return source, ids, graph.create_default_context()


def images_of(context):
    """Return what a camera in the origin sees along z."""
    core = RenderCameraCore("exact", LENS, CLIPPING, np.eye(4))
    camera = DepthRenderCamera(core, DepthRange(0.1, 60.0))
    kinds = ("color", "depth", "label")
    return QueryObject(context).render_images(camera, WORLD, X_WB, kinds=kinds)


@pytest.mark.parametrize("alpha", [1.0, 0.5])
@pytest.mark.parametrize("radii", [np.full(4, 0.25), np.array([0.25, 0.1, 0.05, 0.3])])
def test_balls_are_seen_as_spheres_are(radii, alpha):
    """Also after others were set, and beside another geometry."""
    beside = (Sphere(0.2), (0.5, 0.5, 2.5))
    source, ids, context = context_of(
        [(PointCloud(POINTS[:1], radii[:1]), np.zeros(3)), beside], alpha=alpha
    )
    context.set_points(source, {ids[0]: (POINTS, radii)})
    spheres = [(Sphere(r), p) for r, p in zip(radii, POINTS, strict=True)]
    _, _, expected = context_of([*spheres, beside], alpha=alpha)
    seen, wanted = images_of(context), images_of(expected)
    assert (seen.depth == wanted.depth).all()
    assert (seen.label == wanted.label).all()
    assert (seen.color == wanted.color).all()
    assert (seen.label == 7).any()


def test_a_cloud_without_points_is_not_seen():
    """Nor is one of points, which cover no pixel's ray but by chance."""
    source, ids, context = context_of([(PointCloud([], 0.5), np.zeros(3))])
    assert np.isinf(images_of(context).depth).all()
    context.set_points(source, {ids[0]: POINTS})
    assert np.isfinite(images_of(context).depth).any()
