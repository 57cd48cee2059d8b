"""Images of depth as points: where, how large, without the robot, and what they see through."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PointCloud,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import CameraIntrinsics
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.sensing import DepthRules, DepthView, SeenPoints, SelfFilter
from scene_graph_ros.sensing.depth_kernels import CLEARED, EDGE, KEPT, SEEN_AGAIN
from scene_graph_ros.sensing.near_cells import ROBOT

LENS = CameraIntrinsics(64, 48, 50.0, 60.0, 30.0, 20.5)
X_WC = pose_from_xyz_rpy([0.3, -1.0, 2.0], [2.5, 0.2, 0.7])
FINE = DepthRules(step=1)
NAN, INF = np.nan, np.inf


def flat(depth=1.5):
    """Return an image of a plane across the view."""
    return np.full((LENS.height, LENS.width), depth, np.float32)


def slanted(normal, distance):
    """Return depths of the plane normal . p_C = distance."""
    u, v = np.meshgrid(np.arange(LENS.width), np.arange(LENS.height))
    rays = np.stack([(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, np.ones(u.shape)], -1)
    return (distance / (rays @ np.asarray(normal))).astype(np.float32)


def in_camera(p_WPs):
    """Return points of W in the camera's frame."""
    return (p_WPs - X_WC[:3, 3]) @ X_WC[:3, :3]


def test_a_pixel_is_the_point_on_its_ray_at_its_depth():
    """Row by row: (u - cx) z / fx, (v - cy) z / fy, z, by hand for two pixels."""
    depth = flat(NAN)
    depth[7, 40], depth[9, 3] = 2.0, 0.5
    found = DepthView.of(depth, LENS, X_WC, FINE).points()
    expected = [[10 * 2 / 50, -13.5 * 2 / 60, 2.0], [-27 * 0.5 / 50, -11.5 * 0.5 / 60, 0.5]]
    np.testing.assert_allclose(in_camera(found.p_WPs), expected, atol=1e-12)
    # Alone, each has half the diagonal of its pixel.
    diagonals = [2.0 * np.hypot(1 / 50, 1 / 60), 0.5 * np.hypot(1 / 50, 1 / 60)]
    np.testing.assert_allclose(found.radii, 0.5 * np.array(diagonals), rtol=1e-12)


@pytest.mark.parametrize("depth", [NAN, 0.0, -1.0, -INF, INF, 0.0499, 10.001])
def test_no_depth_is_no_point(depth):
    """NaN, zero, below zero, infinite, and out of the camera's range."""
    assert len(DepthView.of(flat(depth), LENS, X_WC, FINE).points().radii) == 0


def test_of_a_block_the_nearest_pixel_is_the_point():
    """Also in blocks that the image's edge cuts: 64 x 48 in blocks of 5 is 13 x 10."""
    depth = flat(3.0)
    depth[47, 63], depth[12, 12] = 1.0, 2.0
    found = DepthView.of(depth, LENS, X_WC, DepthRules(step=5)).points()
    assert len(found.radii) == 130
    z = np.sort(in_camera(found.p_WPs)[:, 2])
    np.testing.assert_allclose(z[:3], [1.0, 2.0, 3.0], atol=1e-12)


@pytest.mark.parametrize("step", [1, 2, 3])
@pytest.mark.parametrize("normal", [(0, 0, 1), (0.6, 0, 0.8), (0.5, -0.7, 0.51), (0, 0.9, 0.43)])
def test_balls_cover_the_surface_between_neighbours(normal, step):
    """Random points of a slanted plane, inside of the outermost points, are in some ball."""
    normal = np.array(normal) / np.linalg.norm(normal)
    depth = slanted(normal, 1.2)
    is_seen = (depth > 0.05) & (depth < 9.0)
    depth[~is_seen] = NAN
    found = DepthView.of(depth, LENS, X_WC, DepthRules(step=step)).points()
    rng = np.random.default_rng(1)
    v, u = np.nonzero(is_seen[: -2 * step, : -2 * step] & is_seen[2 * step :, 2 * step :])
    pick = rng.integers(0, len(v), 400)
    at = np.stack([u[pick] + step, v[pick] + step], 1) + rng.uniform(-0.5, 0.5, (400, 2))
    rays = np.column_stack(
        [(at[:, 0] - LENS.cx) / LENS.fx, (at[:, 1] - LENS.cy) / LENS.fy, np.ones(400)]
    )
    p_CQs = rays * (1.2 / (rays @ normal))[:, np.newaxis]
    inside = (p_CQs[:, 2] > 0.05) & (p_CQs[:, 2] < 9.0)
    gaps = np.linalg.norm(p_CQs[inside][:, None] - in_camera(found.p_WPs)[None], axis=2)
    # Depths are float32: the balls miss by that at most.
    assert ((gaps - found.radii).min(axis=1) <= 1e-6).all()
    assert inside.sum() > 100


def test_balls_do_not_bridge_a_jump():
    """A near half and a far half: no radius is that of the gap between them."""
    depth = flat(1.0)
    depth[:, 32:] = 3.0
    found = DepthView.of(depth, LENS, X_WC, FINE).points()
    z = in_camera(found.p_WPs)[:, 2]
    footprint = 0.5 * z * np.hypot(1 / LENS.fx, 1 / LENS.fy)
    np.testing.assert_allclose(found.radii, footprint, rtol=1e-6)


def test_the_error_is_added_and_the_region_cuts():
    """The region is one of the world; the radius of the cloud's shape is a depth's error."""
    whole = DepthView.of(flat(), LENS, X_WC, FINE).points()
    low = float(np.median(whole.p_WPs[:, 2]))
    rules = DepthRules(step=1, error=0.25, lower=(-INF, -INF, low))
    cut = DepthView.of(flat(), LENS, X_WC, rules).points()
    kept = whole.p_WPs[:, 2] >= low
    np.testing.assert_array_equal(cut.p_WPs, whole.p_WPs[kept])
    np.testing.assert_allclose(cut.radii, whole.radii[kept] + 0.25, rtol=1e-12)


def robot():
    """Return a scene with bodies on two frames, their ids, and where the frames are."""
    graph = SceneGraph()
    source = graph.register_source("robot")
    frames = [graph.register_frame(source, GeometryFrame(name)) for name in ("arm", "hand")]
    tetrahedron = Mesh(
        vertices=0.3 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        faces=[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    )
    shapes = [
        (frames[0], Capsule(0.06, 0.4), pose_from_xyz_rpy([0.1, 0.0, 0.0], [0.3, 0.0, 0.0])),
        (frames[0], Box(0.2, 0.1, 0.3), pose_from_xyz_rpy([-0.2, 0.1, 0.0], [0.0, 0.5, 0.0])),
        (frames[1], Sphere(0.1), np.eye(4)),
        (frames[1], tetrahedron, pose_from_xyz_rpy([0.0, 0.2, 0.0], [0.1, 0.2, 0.3])),
        (frames[1], HalfSpace(), np.eye(4)),
        (frames[1], PointCloud([[0.0, 0.0, 0.0]], 5.0), np.eye(4)),
    ]
    ids = []
    for k, (frame, shape, X_FG) in enumerate(shapes):
        instance = GeometryInstance(X_FG, shape, f"body_{k}")
        instance.set_proximity_properties(ProximityProperties())
        ids.append(graph.register_geometry(source, frame, instance))
    X_CF = [pose_from_xyz_rpy([0.1, 0.0, 1.0]), pose_from_xyz_rpy([-0.3, 0.2, 1.2])]
    return graph, ids, {f: X_WC @ X for f, X in zip(frames, X_CF, strict=True)}


def test_the_robot_is_what_is_within_the_padding_of_a_body():
    """Of random depths, each by its distance to all bodies; half spaces and clouds are none."""
    graph, ids, X_WF = robot()
    own = SelfFilter(graph.model_inspector(), ids)
    assert set(own.frames) == set(X_WF)
    own.place(X_WF)
    depth = np.random.default_rng(2).uniform(0.6, 1.8, flat().shape).astype(np.float32)
    rules = DepthRules(step=1, padding=0.03, shadow=0)
    view = DepthView.of(depth, LENS, X_WC, rules, own)
    context = graph.create_default_context()
    source = graph.model_inspector().get_owning_source_id(ids[0])
    context.set_frame_poses(source, X_WF)
    all_points = DepthView.of(depth, LENS, X_WC, rules).points().p_WPs
    table = graph.query_object(context).compute_signed_distance_to_points(all_points, 0.03)
    bodies = {int(i) for i in ids[:4]}
    near = sorted({r.point for r in table if int(r.id_G) in bodies})
    assert len(near) > 50
    np.testing.assert_allclose(view.own_points(), all_points[near], atol=1e-12)
    others = np.delete(all_points, near, axis=0)
    np.testing.assert_allclose(view.points().p_WPs, others, atol=1e-12)


def test_a_body_around_the_camera_takes_what_is_in_it():
    """Its box is behind the camera and before it, so that its corners project to nothing."""
    graph = SceneGraph()
    source = graph.register_source("robot")
    instance = GeometryInstance(X_WC, Sphere(0.9), "around")
    instance.set_proximity_properties(ProximityProperties())
    ball = graph.register_anchored_geometry(source, instance)
    own = SelfFilter(graph.model_inspector(), [ball])
    own.place({SceneGraph.world_frame_id(): np.eye(4)})
    for depth, is_own in ((0.5, True), (1.5, False)):
        view = DepthView.of(flat(depth), LENS, X_WC, FINE, own)
        assert (view.mask == ROBOT).all() == is_own
        assert (len(view.points().radii) == 0) == is_own


def ball_before_a_wall(shadow, step=1):
    """Return a view of a ball of the robot before a wall."""
    graph = SceneGraph()
    source = graph.register_source("robot")
    instance = GeometryInstance(X_WC @ pose_from_xyz_rpy([0, 0, 0.8]), Sphere(0.1), "ball")
    instance.set_proximity_properties(ProximityProperties())
    ball = graph.register_anchored_geometry(source, instance)
    own = SelfFilter(graph.model_inspector(), [ball])
    own.place({SceneGraph.world_frame_id(): np.eye(4)})
    depth = flat()
    depth[15:26, 25:36] = 0.72
    rules = DepthRules(step=step, shadow=shadow)
    return DepthView.of(depth, LENS, X_WC, rules, own)


def test_the_shadow_at_the_robots_edge_is_no_point():
    """Pixels within two rows or columns of the robot's: a camera mixes what is before and behind.

    In blocks of two it is one block wide.
    """
    bare, shy = ball_before_a_wall(0), ball_before_a_wall(2)
    is_own = bare.mask == ROBOT
    assert is_own.sum() > 50
    np.testing.assert_array_equal(shy.mask == ROBOT, is_own)
    wide = np.zeros_like(is_own)
    for dv in range(-2, 3):
        for du in range(-2, 3):
            wide |= np.roll(is_own, (dv, du), (0, 1))
    np.testing.assert_array_equal(shy.mask == EDGE, wide & ~is_own)
    assert len(shy.points().radii) == len(bare.points().radii) - (wide & ~is_own).sum()
    blocks = ball_before_a_wall(2, step=2)
    assert (blocks.mask == EDGE).any()
    rows = np.flatnonzero((blocks.mask != 0).any(axis=1))
    own_rows = np.flatnonzero((blocks.mask == ROBOT).any(axis=1))
    assert (rows[0], rows[-1]) == (own_rows[0] - 1, own_rows[-1] + 1)


def at_pixel(u, v, z):
    """Return the point of W that a pixel sees at a depth."""
    p_C = np.array([(u - LENS.cx) / LENS.fx * z, (v - LENS.cy) / LENS.fy * z, z])
    return X_WC[:3, :3] @ p_C + X_WC[:3, 3]


def verdicts(view, *points, radius=0.01):
    """Return what a view says of points."""
    return view.judge(np.array(points), np.full(len(points), radius)).tolist()


def test_what_an_image_says_of_earlier_points():
    """A wall at 1.5 m: before it cleared, on it seen again, behind it, beside and behind: kept."""
    view = DepthView.of(flat(), LENS, X_WC, FINE)
    before, on, behind = (at_pixel(30, 20, z) for z in (1.2, 1.49, 1.8))
    outside, back = at_pixel(70, 20, 1.2), at_pixel(30, 20, -1.0)
    found = verdicts(view, before, on, behind, outside, back)
    assert found == [CLEARED, SEEN_AGAIN, KEPT, KEPT, KEPT]
    # Nearer than the camera sees, and farther.
    assert verdicts(view, at_pixel(30, 20, 0.04)) == [KEPT]
    far = DepthView.of(flat(INF), LENS, X_WC, FINE)
    assert verdicts(far, at_pixel(30, 20, 9.0), at_pixel(30, 20, 11.0)) == [CLEARED, KEPT]


@pytest.mark.parametrize("nothing", [NAN, 0.0, -INF])
def test_a_pixel_without_a_depth_clears_nothing(nothing):
    """It is unknown what its ray went through."""
    depth = flat()
    depth[20, 30] = nothing
    view = DepthView.of(depth, LENS, X_WC, FINE)
    assert verdicts(view, at_pixel(30, 20, 1.2), at_pixel(40, 20, 1.2)) == [KEPT, CLEARED]


def test_a_ball_is_cleared_by_all_rays_that_pass_it():
    """One of them ends before the ball's far side: something may hide the rest of it."""
    depth = flat()
    depth[20, 32] = 1.1
    view = DepthView.of(depth, LENS, X_WC, FINE)
    point = at_pixel(30, 20, 1.2)
    # 0.06 m at 1.2 m are 3 pixels, 0.01 m are one.
    assert verdicts(view, point, radius=0.06) == [KEPT]
    assert verdicts(view, point, radius=0.01) == [CLEARED]


def test_robots_pixels_clear_what_is_before_them_and_their_edges_nothing():
    """Behind the robot nothing is known; in the shadow at its edge depths may be mixed."""
    view = ball_before_a_wall(2)
    before, behind = at_pixel(30, 20, 0.5), at_pixel(30, 20, 1.2)
    assert verdicts(view, before, behind) == [CLEARED, KEPT]
    v, u = (int(each[0]) for each in np.nonzero(view.mask == EDGE))
    assert verdicts(view, at_pixel(u, v, 1.2)) == [KEPT]


def test_a_thing_that_goes_is_cleared_by_the_next_image():
    """A box before a wall, then the wall: no point of the box is left, and none is doubled."""
    depth = flat()
    depth[10:30, 20:40] = 1.0
    first = DepthView.of(depth, LENS, X_WC, FINE)
    seen, counts = SeenPoints.none().after(first, first.points(), 1, 10**6)
    assert counts == (LENS.width * LENS.height, 0, 0, 0)
    again, counts = seen.after(first, first.points(), 2, 10**6)
    assert (len(again), counts.seen_again) == (len(seen), len(seen))
    gone = DepthView.of(flat(), LENS, X_WC, FINE)
    left, counts = again.after(gone, gone.points(), 3, 10**6)
    assert counts.cleared == 400
    np.testing.assert_allclose(in_camera(left.p_WPs)[:, 2], 1.5, atol=1e-12)
    assert len(left) == LENS.width * LENS.height


def test_points_expire_and_the_oldest_make_room():
    """``since`` keeps those that are as old as that; of too many the newest stay."""
    view = DepthView.of(flat(), LENS, X_WC, DepthRules(step=16))
    new = view.points()
    old = SeenPoints(
        np.array([[50.0, 0, 0], [51.0, 0, 0]]), np.full(2, 0.1), np.array([5, 4]), np.zeros(2, int)
    )
    both, counts = old.after(view, new, 9, len(new.radii) + 1)
    assert counts.let_go == 1
    assert both.stamps.tolist() == [5, *[9] * len(new.radii)]
    assert len(both.since(6)) == len(new.radii)
    assert both.since(5) is both
    few, _ = old.after(view, new, 9, 3)
    np.testing.assert_array_equal(few.p_WPs, new.p_WPs[-3:])
    assert both.stamped_at_most(7).stamps.tolist() == [5, *[7] * len(new.radii)]


def test_an_image_of_another_size_is_refused():
    """Depths are those of the lens."""
    with pytest.raises(ValueError, match=r"\(48, 64\)"):
        DepthView.of(np.zeros((4, 4), np.float32), LENS, X_WC, FINE)
