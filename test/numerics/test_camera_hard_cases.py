"""Near planes through bodies, cameras inside, rays through corners and edges, coplanar faces."""

from concurrent.futures import ThreadPoolExecutor

from camera_scenes import (
    CLIPPING,
    color_camera,
    depth_camera,
    icosphere,
    instance,
    pose,
    random_shapes,
    rays,
    scene_of,
    seen,
    SHAPES,
    WORLD,
)
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    ExactRenderEngine,
    RenderLabel,
)

ONE_PIXEL = CameraIntrinsics(1, 1, 1.0, 1.0, 0.0, 0.0)
"""It sees along the axis only, exactly."""
BOUNDED = {name: shape for name, shape in SHAPES.items() if name != "half_space"}


def looking(p_WC, p_WQ):
    """Return the pose of a camera at p_WC that looks at p_WQ."""
    ahead = np.subtract(p_WQ, p_WC) / np.linalg.norm(np.subtract(p_WQ, p_WC))
    right = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    right /= np.linalg.norm(right)
    X = np.eye(4)
    X[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    X[:3, 3] = p_WC
    return X


def axis_depth(shape, X_WG, X_WC, clipping=CLIPPING):
    """Return the depth along a camera's axis."""
    return seen(scene_of([instance(shape, X_WG, "body")]), X_WC, ONE_PIXEL, clipping)[0][0, 0]


@pytest.mark.parametrize("name", BOUNDED)
def test_a_camera_inside_sees_the_inside_everywhere(name):
    """No ray gets out of a closed surface, at any angle."""
    shape = BOUNDED[name]
    lens = CameraIntrinsics(30, 20, 5.0, 6.0, 14.0, 10.0)
    query = scene_of([instance(shape, pose(3, (1.0, 2.0, 3.0)), "body")])
    for seed in range(8):
        depth, rows = seen(query, pose(50 + seed, (1.0, 2.0, 3.0)), lens)
        assert (rows == 0).all()
        assert (depth < 0.3).all()


def test_a_camera_below_a_half_space_sees_its_plane():
    """From both sides, the same depth; what looks away from it sees nothing."""
    for side in (-1.0, 1.0):
        X_WC = looking((0.0, 0.0, 2.0 * side), (0.0, 0.0, 0.0))
        assert axis_depth(HalfSpace(), np.eye(4), X_WC) == 2.0
        X_WC = looking((0.0, 0.0, 2.0 * side), (0.0, 0.0, 3.0 * side))
        assert axis_depth(HalfSpace(), np.eye(4), X_WC) == np.inf


@pytest.mark.parametrize("name", BOUNDED)
def test_the_near_plane_opens_bodies(name):
    """Each ray sees the first surface beyond the near plane: with it inside, the far side."""
    query = scene_of([instance(BOUNDED[name], pose(6, (0.0, 0.0, 0.5)), "body")])
    whole, _ = seen(query)
    cut, _ = seen(query, clipping=ClippingRange(0.5, 64.0))
    is_before = whole < 0.5
    assert is_before.any()
    np.testing.assert_array_equal(cut[~is_before], whole[~is_before])
    assert (cut[is_before] >= 0.5).all()
    assert np.isfinite(cut[is_before]).any()


@pytest.mark.parametrize("name", BOUNDED)
def test_the_far_plane_closes_the_view(name):
    """What is beyond is not seen, to the last bit."""
    query = scene_of([instance(BOUNDED[name], pose(6, (0.0, 0.0, 0.5)), "body")])
    whole, _ = seen(query)
    far = np.sort(whole[np.isfinite(whole)])[whole.size // 40]
    cut, _ = seen(query, clipping=ClippingRange(CLIPPING.near, far))
    np.testing.assert_array_equal(cut, np.where(whole <= far, whole, np.inf))
    assert (cut == far).any()


@pytest.mark.parametrize("name", SHAPES)
def test_a_camera_on_a_surface(name):
    """The surface it is on is nearer than the near plane, so it sees what is behind."""
    shape = SHAPES[name]
    query = scene_of([instance(shape, np.eye(4), "body")])
    X_WC = looking((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    top = 3.0 - axis_depth(shape, np.eye(4), X_WC)
    X_WC = looking((0.0, 0.0, top), (0.0, 0.0, -3.0))
    depth, _ = seen(query, X_WC)
    assert not np.isnan(depth).any()
    assert (depth >= CLIPPING.near).all()
    if name == "half_space":
        assert np.isinf(depth).all()
    else:
        assert 0.01 < depth[15, 19] < 0.3


def test_a_plane_through_the_camera_is_not_seen():
    """A half space seen edge-on, and a ray in a box's face, give no division by zero."""
    assert axis_depth(HalfSpace(), np.eye(4), looking((0, 0, 0), (1, 0, 0))) == np.inf
    along = looking((-1.0, 0.0, 0.5), (1.0, 0.0, 0.5))
    assert axis_depth(Box(1.0, 1.0, 1.0), np.eye(4), along) == 0.5
    beside = looking((-1.0, 0.0, 0.5000001), (1.0, 0.0, 0.5000001))
    assert axis_depth(Box(1.0, 1.0, 1.0), np.eye(4), beside) == np.inf


def test_rays_along_an_axis():
    """Down the middle of a tube, its cap; along its side, outside by a bit, nothing."""
    down = looking((0.01, 0.0, 2.0), (0.01, 0.0, 0.0))
    assert axis_depth(Cylinder(0.1, 1.0), np.eye(4), down) == 1.5
    cap = 2.0 - 0.5 - np.sqrt(0.1**2 - 0.01**2)
    assert axis_depth(Capsule(0.1, 1.0), np.eye(4), down) == pytest.approx(cap, abs=1e-15)
    beside = looking((0.1 + 1e-12, 0.0, 2.0), (0.1 + 1e-12, 0.0, 0.0))
    assert axis_depth(Cylinder(0.1, 1.0), np.eye(4), beside) == np.inf
    assert axis_depth(Capsule(0.1, 1.0), np.eye(4), beside) == np.inf


def test_a_tangent_ray():
    """A hair inside it meets the ball at its closest point to 1e-8, a hair outside it doesn't."""
    for height, expected in ((0.1 - 1e-15, 1.0), (0.1 + 1e-15, np.inf)):
        X_WC = looking((height, 0.0, 1.0), (height, 0.0, 0.0))
        assert axis_depth(Sphere(0.1), np.eye(4), X_WC) == pytest.approx(expected, abs=1e-7)


@pytest.mark.compiled
def test_rays_through_corners_and_edges_of_a_grid():
    """Every pixel's ray meets a corner, an edge or a diagonal: none slips through."""
    lens = CameraIntrinsics(33, 33, 16.0, 16.0, 16.0, 16.0)
    for step in (1 / 16, 1 / 8, 1 / 4):  # at depth 1, pixels are 1/16 apart
        n = int(2.5 / step)
        x = (np.arange(n + 1) - n // 2) * step
        vertices = np.stack(np.meshgrid(x, x, [1.0], indexing="ij"), axis=-1).reshape(-1, 3)
        corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
        faces = np.vstack(
            [
                np.column_stack([corner, corner + 1, corner + n + 2]),
                np.column_stack([corner, corner + n + 2, corner + n + 1]),
            ]
        )
        query = scene_of([instance(Mesh(vertices=vertices, faces=faces), np.eye(4), "grid")])
        depth, _ = seen(query, lens=lens)
        assert (depth == 1.0).all()


@pytest.mark.parametrize("name", ["mesh", "convex", "box", "fine"])
def test_no_ray_slips_through_a_corner_or_an_edge(name):
    """From within, rays aimed at every corner and at points of every edge meet the surface."""
    if name == "fine":
        vertices, faces = icosphere(2)
        shape = Mesh(vertices=vertices, faces=faces)
    elif name == "box":
        vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.1
        shape = Convex(vertices=vertices)
    else:
        shape = SHAPES[name]
        vertices = np.array(shape.vertices)
    X_WG = pose(9, (3.0, -5.0, 7.0))
    query = scene_of([instance(shape, X_WG, "body")])
    rng = np.random.default_rng(2)
    ends = rng.integers(0, len(vertices), (150, 2))
    shares = rng.uniform(0.0, 1.0, (150, 1))
    targets = np.vstack(
        [vertices, vertices[ends[:, 0]] * shares + vertices[ends[:, 1]] * (1 - shares)]
    )
    inside = X_WG[:3, 3] + X_WG[:3, :3] @ vertices.mean(axis=0)
    for p_GQ in targets:
        p_WQ = X_WG[:3, 3] + X_WG[:3, :3] @ p_GQ
        if np.linalg.norm(p_WQ - inside) > 1e-6:
            depth, _ = seen(query, looking(inside, p_WQ), ONE_PIXEL)
            assert np.isfinite(depth[0, 0]), p_GQ


def test_fans_have_no_hole_where_their_triangles_meet():
    """Random fans around a corner that is exactly on the axis, flat ones and needles too."""
    rng = np.random.default_rng(8)
    for trial in range(200):
        n = int(rng.integers(3, 12))
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, n))
        if np.diff(np.append(angles, angles[0] + 2.0 * np.pi)).max() >= np.pi:
            continue
        radii = 10.0 ** rng.uniform(-12, 1, n) if trial % 2 else rng.uniform(0.1, 1.0, n)
        depths = 1.0 + rng.uniform(-0.5, 0.5, n) * (trial % 3)
        rim = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), depths])
        vertices = np.vstack([[0.0, 0.0, 1.0], rim])
        faces = np.column_stack([np.zeros(n, int), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n])
        query = scene_of([instance(Mesh(vertices=vertices, faces=faces), np.eye(4), "fan")])
        depth, _ = seen(query, lens=ONE_PIXEL)
        assert depth[0, 0] == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_a_near_plane_through_triangles_leaves_no_hole(seed):
    """A large triangle that passes the camera is seen wherever its plane is, and it is cut."""
    rng = np.random.default_rng(seed)
    vertices = np.array([[-50.0, 1.0, -40.0], [60.0, 1.0, -30.0], [5.0, 1.0, 80.0]])
    vertices += rng.uniform(-1.0, 1.0, (3, 3)) * (1.0, 0.1, 1.0)
    query = scene_of([instance(Mesh(vertices=vertices, faces=[[0, 1, 2]]), np.eye(4), "big")])
    depth, _ = seen(query)
    n = np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
    expected = (n @ vertices[0]) / (rays() @ n)
    p = rays() * expected[..., None]
    is_ahead = (expected >= CLIPPING.near) & (expected <= CLIPPING.far)
    within = np.ones_like(is_ahead)
    for k in range(3):
        side = np.cross(vertices[(k + 1) % 3] - vertices[k], p - vertices[k])
        within &= side @ n > 0.0
    assert 100 < (is_ahead & within).sum() < is_ahead.size
    np.testing.assert_array_equal(np.isfinite(depth), is_ahead & within)
    np.testing.assert_allclose(depth[within & is_ahead], expected[within & is_ahead], rtol=1e-13)


def test_winding_has_no_effect():
    """Triangles turned over, and meshes mirrored twice, are seen the same, but for rounding."""
    vertices, faces = icosphere(1)
    X_WG = pose(2, (0.0, 0.0, 0.4))
    turned = faces.copy()
    turned[::2] = turned[::2, ::-1]
    images = [
        seen(scene_of([instance(mesh, X_WG, "mesh")]))[0]
        for mesh in (
            Mesh(vertices=vertices, faces=faces),
            Mesh(vertices=vertices, faces=turned),
            Mesh(vertices=vertices * (-1.0, 1.0, 1.0), faces=faces, scale=(-1.0, 1.0, 1.0)),
        )
    ]
    assert np.isfinite(images[0]).any()
    for image in images[1:]:
        np.testing.assert_allclose(image, images[0], rtol=1e-14)


def test_degenerate_triangles_and_loose_ends():
    """Points, segments and repeated faces cost nothing and are not seen; the sheet is open."""
    vertices = np.array([[-1.0, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1], [0, 0, 0.5]])
    faces = [[0, 1, 2], [0, 2, 3], [0, 1, 2], [4, 4, 4], [4, 4, 0], [0, 4, 2]]
    query = scene_of([instance(Mesh(vertices=vertices, faces=faces), np.eye(4), "sheet")])
    depth, _ = seen(query)
    assert not np.isnan(depth).any()
    is_seen = (np.abs(rays()[..., :2]) <= 1.0).all(axis=2)
    np.testing.assert_array_equal(np.isfinite(depth), is_seen)


@pytest.mark.parametrize("points", [1, 2, 3])
def test_flat_hulls(points):
    """The hull of a point or a segment has no surface; that of a triangle is a triangle."""
    corners = np.array([[-1.0, -1.0, 1.0], [3.0, -1.0, 1.0], [-1.0, 3.0, 1.0]])[:points]
    query = scene_of([instance(Convex(vertices=corners), np.eye(4), "flat")])
    depth, _ = seen(query)
    assert np.isfinite(depth).any() == (points == 3)


@pytest.mark.compiled
def test_coplanar_faces_do_not_flicker():
    """The smaller id is seen, however both are turned, wherever the camera is to a nanometre."""
    for seed in range(6):
        X_WG = pose(seed, (0.03, 0.02, 0.6))
        shifted = X_WG.copy()
        shifted[:3, 3] += X_WG[:3, :3] @ (0.03, 0.04, 0.05)
        first = instance(Box(0.3, 0.3, 0.3), X_WG, "first")
        # Three of its faces are in those of the first.
        second = instance(Box(0.24, 0.22, 0.2), shifted, "second")
        for bodies in ([first, second], [second, first]):
            query = scene_of(bodies)
            for step in range(5):
                X_WC = pose(p=(0.0, 1e-9 * step, 3e-10 * step))
                assert set(np.unique(seen(query, X_WC)[1])) == {-1, 0}


def test_the_same_body_twice_shows_the_first():
    """Of equal bodies in one place, the one with the smaller id is seen, whatever its shape."""
    for k, shape in enumerate(SHAPES.values()):
        X_WG = pose(k, (0.0, 0.0, 0.5))
        twins = [instance(shape, X_WG, "a", label=1), instance(shape, X_WG, "b", label=2)]
        for order in (twins, twins[::-1]):
            label = scene_of(order).render_label_image(color_camera(), WORLD, np.eye(4))
            assert set(np.unique(label)) <= {1, RenderLabel.EMPTY}
            assert 1 in label


def test_horizon():
    """A floor is seen up to where its rays meet it within the clipping, and no further."""
    X_WC = np.eye(4)
    X_WC[:3, :3] = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # ahead is y, down is -z
    X_WC[2, 3] = 1.5
    depth, _ = seen(scene_of([instance(HalfSpace(), np.eye(4), "floor")]), X_WC)
    with np.errstate(divide="ignore"):
        expected = 1.5 / rays()[..., 1]
    expected[(expected < 0.0) | (expected > CLIPPING.far)] = np.inf
    np.testing.assert_allclose(depth, expected, rtol=1e-15)
    assert 0 < np.isinf(depth).sum() < depth.size


@pytest.mark.parametrize(
    "lens",
    [
        ONE_PIXEL,
        CameraIntrinsics(1, 40, 10.0, 35.0, 0.2, 20.0),
        CameraIntrinsics(40, 1, 35.0, 10.0, 20.0, 0.2),
        CameraIntrinsics(9, 7, 3.0, 300.0, 4.0, -50.0),
        CameraIntrinsics(17, 5, 1e6, 1e6, -2e5, 3e5),
    ],
)
def test_lenses_of_all_kinds(lens):
    """Each pixel is what a camera of that pixel alone sees: bounds and lanes lose nothing."""
    bodies = [*random_shapes(25, 11, reach=0.5), instance(HalfSpace(), pose(1, (0, 0, 3)), "h")]
    query = scene_of(bodies)
    depth, rows = seen(query, lens=lens)
    for v in range(0, lens.height, 3):
        for u in range(0, lens.width, 2):
            alone = CameraIntrinsics(1, 1, lens.fx, lens.fy, lens.cx - u, lens.cy - v)
            one, row = seen(query, lens=alone)
            assert rows[v, u] == row[0, 0]
            assert depth[v, u] == pytest.approx(one[0, 0], rel=1e-9)


@pytest.mark.parametrize(
    "shape", [Ellipsoid(1.0, 1e-3, 0.1), Cylinder(1e-4, 5.0), Capsule(2.0, 1e-3)]
)
def test_thin_shapes(shape):
    """Needles and discs, across the view: what is seen is on the surface."""
    X_WC = looking((1.0, 2.0, 3.0), (0.0, 0.0, 0.0))
    lens = CameraIntrinsics(40, 30, 400.0, 400.0, 20.0, 15.0)
    query = scene_of([instance(shape, np.eye(4), "thin")])
    depth, _ = seen(query, X_WC, lens)
    is_hit = np.isfinite(depth)
    assert is_hit.any()
    p_WQ = (rays(lens)[is_hit] * depth[is_hit, None]) @ X_WC[:3, :3].T + X_WC[:3, 3]
    assert np.abs(query.compute_signed_distance_to_points(p_WQ).distance).max() < 4e-12


def test_deformable_geometry_is_seen_as_it_is():
    """Its boundary is where its vertices are: of twice the size, the near face is nearer."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source = graph.register_source("s")
    X_WG = pose(p=(0.0, 0.0, 1.0))
    soft = instance(Box(0.5, 0.5, 0.5), X_WG, "soft", label=3)
    soft_id = graph.register_deformable_geometry(source, WORLD, soft, 0.3)
    ball = instance(Sphere(0.05), pose(p=(0.0, 0.0, 0.6)), "ball", label=4)
    graph.register_anchored_geometry(source, ball)
    context = graph.create_default_context()
    query = graph.query_object(context)
    camera = depth_camera()

    def pixels():
        images = query.render_images(camera, WORLD, np.eye(4))
        return images.depth[15, 25], images.label[15, 25], images.label[15, 19]

    assert pixels() == (pytest.approx(0.75, abs=1e-7), 3, 4)
    q_WG = query.get_configurations_in_world(soft_id) - X_WG[:3, 3]
    context.set_configurations(source, {soft_id: 2.0 * q_WG + X_WG[:3, 3]})
    assert pixels() == (pytest.approx(0.5, abs=1e-7), 3, 3)
    graph.remove_role(source, soft_id, PerceptionProperties.role, context=context)
    assert pixels()[1:] == (RenderLabel.EMPTY, 4)


def test_a_mesh_that_is_driven_is_seen_in_place_of_the_boundary():
    """A square within a soft box, across the view: it goes where the material takes it."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    source = graph.register_source("s")
    X_WG = pose(p=(0.0, 0.0, 1.0))
    soft = instance(Box(0.5, 0.5, 0.5), X_WG, "soft", label=3)
    corners = [(-0.12, -0.12, 0.12), (0.12, -0.12, 0.12), (0.12, 0.12, 0.12)]
    square = Mesh(vertices=[*corners, (-0.12, 0.12, 0.12)], faces=[(0, 1, 2), (0, 2, 3)])
    soft.perception_properties().add_property("deformable", "embedded_mesh", square)
    soft_id = graph.register_deformable_geometry(source, WORLD, soft, 0.3)
    context = graph.create_default_context()
    query = graph.query_object(context)
    camera = depth_camera()
    lens = camera.core.intrinsics

    def check(depth, half):
        images = query.render_images(camera, WORLD, np.eye(4))
        u, v = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
        x, y = depth * (u - lens.cx) / lens.fx, depth * (v - lens.cy) / lens.fy
        away = np.maximum(np.abs(x), np.abs(y)) - half
        assert (np.abs(away) > 1e-6).all()
        np.testing.assert_array_equal(images.label, np.where(away < 0.0, 3, RenderLabel.EMPTY))
        assert np.abs(images.depth[away < 0.0] - depth).max() < 1e-6

    check(1.12, 0.12)
    q_WG = query.get_configurations_in_world(soft_id) - X_WG[:3, 3]
    context.set_configurations(source, {soft_id: 2.0 * q_WG + X_WG[:3, 3]})
    check(1.24, 0.24)


@pytest.mark.compiled
def test_threads_see_the_same():
    """Images of one snapshot that several threads ask for at once are the same bytes."""
    query = scene_of(random_shapes(40, 13)).bake()
    camera = depth_camera(CameraIntrinsics(80, 60, 70.0, 70.0, 40.0, 30.0))
    with ThreadPoolExecutor(4) as pool:
        images = list(pool.map(lambda _: query.render_images(camera, WORLD, np.eye(4)), range(12)))
    for other in images[1:]:
        assert all(a.tobytes() == b.tobytes() for a, b in zip(images[0], other, strict=True))


def test_many_labels():
    """A row of balls with labels from the least to the greatest, each seen where it is."""
    numbers = np.linspace(0, RenderLabel.MAX_FREE, 40).astype(int)
    balls = [
        instance(Sphere(0.01), pose(p=((k - 20) / 40, 0.0, 1.0)), f"ball_{n}", label=int(n))
        for k, n in enumerate(numbers)
    ]
    lens = CameraIntrinsics(40, 1, 40.0, 40.0, 20.0, 0.0)
    label = scene_of(balls).render_label_image(color_camera(lens), WORLD, np.eye(4))
    np.testing.assert_array_equal(label[0], numbers)
