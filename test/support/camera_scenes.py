"""Scenes before cameras, and what the exact renderer sees of them before it rounds."""

import numpy as np
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)
from scene_graph_ros.geometry.perception.exact.bodies import row_of
from scene_graph_ros.geometry.perception.exact.view import look

WORLD = SceneGraph.world_frame_id()
LENS = CameraIntrinsics(40, 30, 35.0, 31.0, 18.7, 15.2)
CLIPPING = ClippingRange(1 / 1024, 64.0)


def icosphere(subdivisions=1, radius=0.1):
    """Return vertices and faces of an icosahedron whose triangles are cut into four each."""
    g = (1.0 + np.sqrt(5.0)) / 2.0
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)]
    vertices = [np.roll(c, k) / np.hypot(1.0, g) for k in (0, 1, 2) for c in np.array(corners)]
    points = np.array(vertices)
    side = min(np.linalg.norm(points[0] - p) for p in points[1:])
    faces = [
        (i, j, k) if np.linalg.det(points[[i, j, k]]) > 0 else (i, k, j)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if all(
            abs(np.linalg.norm(points[a] - points[b]) - side) < 1e-9
            for a, b in ((i, j), (j, k), (k, i))
        )
    ]
    for _ in range(subdivisions):
        known = {}

        def middle(i, j, known=known):
            key = (min(i, j), max(i, j))
            if key not in known:
                known[key] = len(vertices)
                vertices.append(
                    (vertices[i] + vertices[j]) / np.linalg.norm(vertices[i] + vertices[j])
                )
            return known[key]

        finer = []
        for i, j, k in faces:
            a, b, c = middle(i, j), middle(j, k), middle(k, i)
            finer += [(i, a, c), (a, j, b), (c, b, k), (a, b, c)]
        faces = finer
    return radius * np.array(vertices), np.array(faces)


_POINTS = np.random.default_rng(3).normal(size=(20, 3)) * 0.06
SHAPES = {
    "sphere": Sphere(0.1),
    "capsule": Capsule(0.05, 0.15),
    "box": Box(0.2, 0.1, 0.15),
    "cylinder": Cylinder(0.07, 0.2),
    "ellipsoid": Ellipsoid(0.12, 0.08, 0.03),
    "half_space": HalfSpace(),
    "convex": Convex(vertices=_POINTS),
    "mesh": Mesh(vertices=icosphere()[0], faces=icosphere()[1]),
}
"""One of each of the eight shapes, about 0.2 m large."""


def pose(seed=None, p=(0.0, 0.0, 0.0)):
    """Return a pose with a random rotation, or none, at p."""
    X = np.eye(4)
    if seed is not None:
        X[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    X[:3, 3] = p
    return X


def instance(shape, X, name, *, label=None, **properties):
    """Return an instance that cameras see and point queries measure."""
    result = GeometryInstance(X, shape, name)
    perception = PerceptionProperties()
    if label is not None:
        perception.add_property("label", "id", label)
    for group, (key, value) in properties.items():
        perception.add_property(group, key, value)
    result.set_perception_properties(perception)
    result.set_proximity_properties(ProximityProperties())
    return result


def scene_of(instances):
    """Return queries of a scene with these instances in the world, and a renderer "exact"."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source = graph.register_source("scene")
    for one in instances:
        graph.register_anchored_geometry(source, one)
    return graph.query_object(graph.create_default_context())


def random_shapes(count, seed, reach=0.4, ahead=1.2):
    """Return instances of all shapes with an end in random poses, label k for the k-th."""
    rng = np.random.default_rng(seed)
    shapes = [shape for shape in SHAPES.values() if not isinstance(shape, HalfSpace)]
    return [
        instance(
            shapes[k % len(shapes)],
            pose(100 * seed + k, rng.uniform(-reach, reach, 3) + np.array([0.0, 0.0, ahead])),
            f"body_{k}",
            label=k,
        )
        for k in range(count)
    ]


def core(lens=LENS, clipping=CLIPPING, renderer="exact", X_BS=None):
    """Return what all cameras have."""
    if X_BS is None:
        return RenderCameraCore(renderer, lens, clipping)
    return RenderCameraCore(renderer, lens, clipping, X_BS)


def color_camera(*args, **kwargs):
    """Return a camera of colour and label."""
    return ColorRenderCamera(core(*args, **kwargs))


def depth_camera(*args, depth_range=None, **kwargs):
    """Return a camera of all kinds; its depth range is the clipping unless given."""
    made = core(*args, **kwargs)
    limits = depth_range or (made.clipping.near, made.clipping.far)
    return DepthRenderCamera(made, DepthRange(*limits))


def seen(query, X_WC=None, lens=LENS, clipping=CLIPPING):
    """Return (depth, row) per pixel, unrounded: inf and -1 where nothing is."""
    X_WC = np.eye(4) if X_WC is None else X_WC
    view = look(query.snapshot, core(lens, clipping), X_WC, (1.0, 1.0, 1.0, 1.0))
    shape = (lens.height, lens.width)
    depth = view.screen.depth[: shape[0], : shape[1]].copy()
    rows = np.array([row_of(n) if n >= 0 else -1 for n in view.screen.seen[:, : shape[1]].flat])
    return depth, rows.reshape(shape)


def rays(lens=LENS):
    """Return the directions (height, width, 3) of the pixels, with depth 1."""
    u, v = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
    x, y = (u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy
    return np.stack([x, y, np.ones_like(x)], axis=-1)
