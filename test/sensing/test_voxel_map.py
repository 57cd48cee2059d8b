"""Voxels that images of depth fill: against rays that are followed one by one."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Voxel
from scene_graph_ros.geometry.perception import CameraIntrinsics
from scene_graph_ros.sensing import CloudView, DepthRules, DepthView, voxels_after
from scene_graph_ros.sensing.depth_kernels import EDGE, ROBOT

LENS = CameraIntrinsics(48, 36, 30.0, 33.0, 23.2, 17.7)
FREE, OCCUPIED, UNKNOWN = (int(state) for state in Voxel)


def pose(rng, at):
    """Return a pose that is turned at random."""
    X = np.eye(4)
    X[:3, :3] = Rotation.random(rng=rng).as_matrix()
    X[:3, 3] = at
    return X


def scene_of_balls(rng):
    """Return an image of balls before a wall, and where pixels' rays pass."""
    v, u = np.mgrid[: LENS.height, : LENS.width]
    rays = np.stack([(u - LENS.cx) / LENS.fx, (v - LENS.cy) / LENS.fy, np.ones(u.shape)], -1)
    depth = np.full(u.shape, 3.0)
    for _ in range(5):
        center, radius = rng.uniform([-0.8, -0.6, 1.0], [0.8, 0.6, 2.5]), rng.uniform(0.1, 0.3)
        a = (rays**2).sum(-1)
        b = rays @ center
        root = b**2 - a * (center @ center - radius**2)
        hit = root > 0.0
        depth[hit] = np.minimum(depth[hit], ((b - np.sqrt(root.clip(0))) / a)[hit])
    depth[rng.uniform(size=u.shape) < 0.02] = np.nan
    depth[rng.uniform(size=u.shape) < 0.02] = 0.0
    depth[rng.uniform(size=u.shape) < 0.02] = np.inf
    return depth.astype(np.float32), rays


def frustum_grid():
    """Return the counts and the edge of a grid that is in view as a part."""
    return (23, 19, 30), 0.11


def by_hand(states, voxel, X_WG, view):
    """Return the states by the definition, voxel by voxel and pixel by pixel."""
    rules, result = view.rules, states.copy()
    X_CG = np.linalg.inv(view.X_WC) @ X_WG
    depth = view.depth.astype(float)
    shown = view.mask[
        np.ix_(np.arange(depth.shape[0]) // rules.step, np.arange(depth.shape[1]) // rules.step)
    ]
    usable = np.where((depth >= rules.near) & (shown != EDGE), depth.clip(None, rules.far), 0.0)
    corners = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    for at in np.ndindex(states.shape):
        p = (np.array(at) + corners) * voxel @ X_CG[:3, :3].T + X_CG[:3, 3]
        if p[:, 2].min() < rules.near:
            continue
        u = LENS.fx * p[:, 0] / p[:, 2] + LENS.cx
        v = LENS.fy * p[:, 1] / p[:, 2] + LENS.cy
        first = np.floor([v.min() + 0.5, u.min() + 0.5]).astype(int)
        last = np.floor([v.max() + 0.5, u.max() + 0.5]).astype(int)
        if (first < 0).any() or (last >= depth.shape).any():
            continue
        window = usable[first[0] : last[0] + 1, first[1] : last[1] + 1]
        if window.min() > p[:, 2].max() + rules.margin:
            result[at] = FREE
    for row, column in np.argwhere((depth >= rules.near) & (depth <= rules.far) & (shown == 0)):
        z = depth[row, column]
        p_C = np.array([(column - LENS.cx) / LENS.fx * z, (row - LENS.cy) / LENS.fy * z, z, 1.0])
        p_W = view.X_WC @ p_C
        if (p_W[:3] < rules.lower).any() or (p_W[:3] > rules.upper).any():
            continue
        at = np.floor((np.linalg.inv(X_WG) @ p_W)[:3] / voxel).astype(int)
        if (at >= 0).all() and (at < states.shape).all():
            result[tuple(at)] = OCCUPIED
    return result


@pytest.mark.parametrize("step", [1, 2, 5])
def test_states_are_those_of_the_definition(step):
    """With balls, pixels without a depth, a robot, its shadow, and a region."""
    rng = np.random.default_rng(step)
    depth, _ = scene_of_balls(rng)
    rules = DepthRules(step=step, far=2.9, margin=0.03, upper=(9.0, 9.0, 1.4))
    counts, voxel = frustum_grid()
    view = DepthView.of(depth, LENS, pose(rng, (0.3, 0.2, 0.1)), rules)
    view.mask[2:5, 1:4], view.mask[1, 1:4] = ROBOT, EDGE
    X_CG = pose(rng, (0.0, 0.0, 0.0))
    X_CG[:3, 3] = np.array([0.0, 0.0, 1.8]) - X_CG[:3, :3] @ (0.5 * voxel * np.array(counts))
    X_WG = view.X_WC @ X_CG
    before = rng.choice([0, 1, 2], counts, p=[0.1, 0.3, 0.6]).astype(np.uint8)
    after, changed = voxels_after(before, voxel, X_WG, view)
    expected = by_hand(before, voxel, X_WG, view)
    assert (after == expected).all()
    assert changed.freed >= ((before != FREE) & (after == FREE)).sum()
    assert changed.hit == ((before != OCCUPIED) & (after == OCCUPIED)).sum()
    assert min(np.bincount(after.reshape(-1), minlength=3)) > 20
    assert ((before == OCCUPIED) & (after == FREE)).any()


def test_no_free_voxel_holds_a_point_of_a_ray_s_end_nor_lies_behind_one():
    """Points along all rays: behind the first surface nothing is free that was not."""
    rng = np.random.default_rng(9)
    depth, rays = scene_of_balls(rng)
    view = DepthView.of(depth, LENS, np.eye(4), DepthRules(step=1, margin=0.0))
    counts, voxel = (30, 30, 40), 0.1
    X_WG = np.eye(4)
    X_WG[:3, 3] = (-1.5, -1.5, 0.0)
    after, _ = voxels_after(np.full(counts, UNKNOWN), voxel, X_WG, view)
    known = np.where(np.isfinite(depth) & (depth > 0.0), depth, 0.0).astype(float)
    for ratio in (1.0, 1.001, 1.05, 1.3, 2.0):
        p = (rays * (known * ratio)[..., np.newaxis]).reshape(-1, 3)
        at = np.floor((p - X_WG[:3, 3]) / voxel).astype(int)
        inside = (at >= 0).all(1) & (at < counts).all(1) & (known.reshape(-1) > 0.0)
        assert (after[tuple(at[inside].T)] != FREE).all()
    assert (after == FREE).sum() > 1000


def test_what_goes_away_becomes_free_and_what_is_hidden_stays():
    """A box before a wall, then none; a camera that looks away changes nothing."""
    depth = np.full((LENS.height, LENS.width), 2.95, np.float32)
    depth[12:24, 16:32] = 1.55
    counts, voxel, X_WG = (40, 40, 40), 0.1, np.eye(4)
    X_WG[:3, 3] = (-2.0, -2.0, 0.0)
    rules, unknown = DepthRules(step=1), np.full(counts, UNKNOWN, np.uint8)
    seen, counted = voxels_after(unknown, voxel, X_WG, DepthView.of(depth, LENS, np.eye(4), rules))
    assert seen[20, 20, 15] == OCCUPIED
    assert seen[20, 20, 10] == FREE
    assert (seen[20, 20, 16:] == UNKNOWN).all()
    assert counted.hit == (seen == OCCUPIED).sum()
    depth[:] = 2.95
    gone, _ = voxels_after(seen, voxel, X_WG, DepthView.of(depth, LENS, np.eye(4), rules))
    assert gone[20, 20, 15] == FREE
    assert gone[20, 20, 29] == OCCUPIED
    away = np.diag([-1.0, 1.0, -1.0, 1.0])
    same, counted = voxels_after(gone, voxel, X_WG, DepthView.of(depth, LENS, away, rules))
    assert (same == gone).all()
    assert counted == (0, 0)


def test_images_and_grids_of_nothing_change_nothing():
    """No depth at all, a grid without voxels, one far away, one of one pixel."""
    rules = DepthRules(step=1)
    for value in (0.0, np.nan, -np.inf, 0.01):
        depth = np.full((LENS.height, LENS.width), value, np.float32)
        view = DepthView.of(depth, LENS, np.eye(4), rules)
        before = np.full((9, 9, 9), UNKNOWN, np.uint8)
        after, counted = voxels_after(before, 0.2, np.eye(4), view)
        assert (after == before).all()
        assert counted == (0, 0)
    view = DepthView.of(np.full(depth.shape, 2.0, np.float32), LENS, np.eye(4), rules)
    far = np.eye(4)
    far[:3, 3] = 1e12
    for X_WG, counts in ((far, (4, 4, 4)), (np.eye(4), (0, 4, 4))):
        after, counted = voxels_after(np.full(counts, UNKNOWN), 0.1, X_WG, view)
        assert (after == UNKNOWN).all()
        assert counted == (0, 0)
    one = CameraIntrinsics(1, 1, 1.0, 1.0, 0.0, 0.0)
    view = DepthView.of(np.array([[np.inf]], np.float32), one, np.eye(4), rules)
    X_WG = np.eye(4)
    X_WG[:3, 3] = (-0.05, -0.05, 1.0)
    after, _ = voxels_after(np.full((1, 1, 200), UNKNOWN), 0.1, X_WG, view)
    # Rays beyond the range are free up to it, 10 m, but for the margin.
    assert (after[0, 0] == FREE).sum() == 89


@pytest.mark.parametrize(
    ("states", "voxel", "X_WG", "told"),
    [
        (np.zeros((2, 2)), 0.1, np.eye(4), "must be"),
        (np.full((2, 2, 2), 3), 0.1, np.eye(4), r"occupancy\[0, 0, 0\] must be 0"),
        (np.zeros((2, 2, 2), int), 0.0, np.eye(4), "voxel must be an edge"),
        (np.zeros((2, 2, 2), int), np.nan, np.eye(4), "voxel must be an edge"),
        (np.zeros((2, 2, 2), int), 0.1, np.full((4, 4), np.nan), "X_WG"),
        (np.zeros((2, 2, 2), int), 0.1, np.diag([2.0, 1.0, 1.0, 1.0]), "X_WG"),
    ],
)
def test_grids_that_are_none_are_refused_by_name(states, voxel, X_WG, told):
    """As shapes and poses are."""
    view = DepthView.of(
        np.ones((LENS.height, LENS.width), np.float32), LENS, np.eye(4), DepthRules()
    )
    with pytest.raises(ValueError, match=told):
        voxels_after(states, voxel, X_WG, view)


def test_a_camera_within_the_grid_and_voxels_about_it():
    """Voxels that reach behind the camera, or are nearer than it sees, are not known."""
    view = DepthView.of(
        np.full((LENS.height, LENS.width), 5.0, np.float32), LENS, np.eye(4), DepthRules(near=0.5)
    )
    X_WG = np.eye(4)
    for voxel in (0.05, 0.3, 4.0, 1e5):
        X_WG[:3, 3] = -5.5 * voxel
        after, _ = voxels_after(np.full((11, 11, 11), UNKNOWN), voxel, X_WG, view)
        assert after[5, 5, 5] != FREE
        far = (np.arange(11) + 1 - 5.5) * voxel
        assert (after[:, :, (far - voxel < 0.5) | (far > 5.0 - 0.02)] != FREE).all()


TANGENT = 1.125


def faces_by_hand(states, voxel, X_SG, cloud):
    """Return the states by the definition: six images, pixel by pixel, and the points."""
    rules, result = cloud.rules, states.copy()
    distance = np.linalg.norm(cloud.p_SPs, axis=1)
    side = math.ceil(2.0 * TANGENT / (2.0 * cloud.grid.edge))
    corners = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    at = np.array(list(np.ndindex(states.shape)))
    boxes = (at[:, np.newaxis] + corners) * voxel @ X_SG[:3, :3].T + X_SG[:3, 3]
    for axis, sign in ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)):
        others = [(axis + 1) % 3, (axis + 2) % 3]

        def pixels(p, axis=axis, sign=sign, others=others):
            with np.errstate(divide="ignore", invalid="ignore"):
                where = p[..., others] / (sign * p[..., [axis]])
            mirror = np.array([sign, 1.0])  # which leaves the frame right-handed
            return 0.5 * side * (mirror * where / TANGENT + 1.0) - 0.5

        z = sign * cloud.p_SPs[:, axis]
        u = np.floor(pixels(cloud.p_SPs) + 0.5)
        inside = (z > 0.0) & (u >= 0).all(1) & (u < side).all(1)
        ends = np.where((cloud.mask == EDGE) | (distance < rules.near), 0.0, z)
        ends = ends * np.minimum(1.0, rules.far / distance)
        depth = np.full((side, side), np.inf)
        np.minimum.at(depth, tuple(u[inside].astype(int).T), ends[inside])
        depth[depth == np.inf] = 0.0
        for index, box in zip(at, boxes, strict=True):
            if (sign * box[:, axis]).min() < 1e-6:
                continue
            seen = pixels(box)
            first = np.floor(seen.min(0) + 0.5).astype(int)
            last = np.floor(seen.max(0) + 0.5).astype(int)
            if (first < 0).any() or (last >= side).any():
                continue
            window = depth[first[0] : last[0] + 1, first[1] : last[1] + 1]
            if window.min() > (sign * box[:, axis]).max() + rules.margin:
                result[tuple(index)] = FREE
    p_GPs = (cloud.p_SPs - X_SG[:3, 3]) @ X_SG[:3, :3] / voxel
    for p, far, mark in zip(np.floor(p_GPs).astype(int), distance, cloud.mask, strict=True):
        there = (p >= 0).all() and (p < states.shape).all()
        if mark == 0 and rules.near <= far <= rules.far and there:
            result[tuple(p)] = OCCUPIED
    return result


def test_clouds_free_what_all_their_rays_see_through():
    """In a room with a ball; rays that end at a robot clear, those beside it do not."""
    rng = np.random.default_rng(4)
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, 40), np.linspace(-1.0, 1.0, 40))
    sides = [np.stack([u, v, np.full(u.shape, s)], -1).reshape(-1, 3) for s in (-1.0, 1.0)]
    rays = np.concatenate([np.roll(side, k, axis=1) for side in sides for k in range(3)])
    rays /= np.linalg.norm(rays, axis=1)[:, np.newaxis]
    reach = 1.4 / np.abs(rays).max(axis=1)  # the walls
    ball = np.array([0.7, 0.1, 0.2])
    toward = rays @ ball
    root = toward**2 - (ball @ ball - 0.3**2)
    hit = (root > 0.0) & (toward > 0.0)
    reach[hit] = (toward - np.sqrt(root.clip(0.0)))[hit]
    X_WS = pose(rng, (0.3, -0.2, 0.5))
    cloud = CloudView.of(rays * reach[:, np.newaxis], X_WS, DepthRules(far=1.6, margin=0.01))
    cloud.mask[rays[:, 2] > 0.95], cloud.mask[rays[:, 2] > 0.98] = EDGE, ROBOT
    counts, voxel = (21, 20, 19), 0.15
    X_SG = pose(rng, (0.0, 0.0, 0.0))
    X_SG[:3, 3] = -X_SG[:3, :3] @ (0.5 * voxel * np.array(counts))
    before = rng.choice([0, 1, 2], counts, p=[0.1, 0.3, 0.6]).astype(np.uint8)
    after, changed = voxels_after(before, voxel, X_WS @ X_SG, cloud)
    expected = faces_by_hand(before, voxel, X_SG, cloud)
    assert (after == expected).all()
    assert changed.hit == ((before != OCCUPIED) & (after == OCCUPIED)).sum() > 100
    assert changed.freed >= ((before != FREE) & (after == FREE)).sum() > 300
    # No ray ends in free space, nor goes on there behind its end.
    for ratio in (1.0, 1.1, 1.5):
        p_GPs = (ratio * cloud.p_SPs - X_SG[:3, 3]) @ X_SG[:3, :3] / voxel
        at = np.floor(p_GPs[(cloud.mask == 0) & (reach < 1.6)]).astype(int)
        at = at[(at >= 0).all(1) & (at < counts).all(1)]
        assert ((after[tuple(at.T)] != FREE) | (before[tuple(at.T)] == FREE)).all()


def test_a_cloud_without_points_changes_nothing():
    """Nor one of which all points are too near."""
    before = np.full((3, 3, 3), UNKNOWN)
    for points, near in (([], 0.0), ([[0.0, 0.0, 0.2]], 0.5)):
        cloud = CloudView.of(np.reshape(points, (-1, 3)), np.eye(4), DepthRules(near=near))
        after, changed = voxels_after(before, 0.1, np.eye(4), cloud)
        assert (after == before).all()
        assert changed == (0, 0)
