"""Derivatives of the distance against central differences of the distance itself."""

from hard_corpus.batches import Complaint, relative
from hard_corpus.constructed import BODIES, constructed, pair_of, random_pose
from hard_corpus.scenes import scene_of
from hard_corpus.sites import pose
from high_precision import BODIES as CURVED
from high_precision import reference_near
import mpmath as mp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
)

CONVEX = {name: body for name, body in BODIES.items() if "triangles" not in name}
STEP = 1e-5
"""Metres and radians: the error of a central difference is of its square, or rounding over it."""


def moved(X, k, step):
    """Return the pose moved along axis k of the spatial velocity (angular, linear) in W."""
    X = X.copy()
    if k < 3:
        X[:3, :3] = Rotation.from_rotvec(step * np.eye(3)[k]).as_matrix() @ X[:3, :3]
    else:
        X[k - 3, 3] += step
    return X


def one_of_each_pair(distance):
    """Return one generic contact of each of the 35 pairs, moved a little off its construction."""
    rng = np.random.default_rng(7)
    chosen = {}
    for case in constructed(distance, bodies=CONVEX, rolls=(0.7,)):
        smooth = ("side", "smooth", "cap", "face", "rim ", "edge ", "vertex ")
        if pair_of(case) not in chosen and any(word in case.label for word in smooth):
            slip = pose(Rotation.from_rotvec(0.02 * rng.normal(size=3)).as_matrix(), [0, 0, 0])
            chosen[pair_of(case)] = case._replace(X_WB=case.X_WB @ slip)
    assert len(chosen) == 35
    return list(chosen.values())


@pytest.mark.parametrize("distance", [2e-2, -1e-2])
def test_derivative_of_the_distance_is_the_central_difference(distance):
    """The 6-vector of either pose predicts how the distance changes, for all 35 pairs.

    All 24 neighbours of a pair are pairs of their own in one scene: B's copies, moved, and A's.
    """
    for case in one_of_each_pair(distance):
        scene_graph = SceneGraph()
        source = scene_graph.register_source("pairs")
        ids, poses = [], {}
        for name, shape, X in [("A", case.A, case.X_WA), ("B", case.B, case.X_WB)]:
            for k in (None, *range(6)):
                for sign in (0.0,) if k is None else (1.0, -1.0):
                    label = f"{name}{k}{sign}"
                    frame = scene_graph.register_frame(source, GeometryFrame(label))
                    instance = GeometryInstance(np.eye(4), shape, label)
                    geometry = scene_graph.register_geometry(source, frame, instance)
                    scene_graph.assign_role(source, geometry, ProximityProperties())
                    poses[frame] = X if k is None else moved(X, k, sign * STEP)
                    ids.append(geometry)
        context = scene_graph.create_default_context()
        context.set_frame_poses(source, poses)
        query = scene_graph.query_object(context)
        ask = query.compute_signed_distance_pair_closest_points
        A, B = ids[0], ids[13]
        result = ask(A, B, derivatives=True)
        for k in range(6):
            by_A = (ask(ids[1 + 2 * k], B).distance - ask(ids[2 + 2 * k], B).distance) / (2 * STEP)
            by_B = (ask(A, ids[14 + 2 * k]).distance - ask(A, ids[15 + 2 * k]).distance) / (
                2 * STEP
            )
            # Third derivatives are at most 1 / 1 cm^2 here: STEP^2 times that is 1e-6.
            assert result.ddistance_dX_WA[k] == pytest.approx(by_A, abs=2e-6), (case.label, k)
            assert result.ddistance_dX_WB[k] == pytest.approx(by_B, abs=2e-6), (case.label, k)


def exact_motion(k, step):
    """Return the (4, 4) motion of ``moved`` about the origin of W, in mpmath."""
    X = np.array([[mp.mpf(i == j) for j in range(4)] for i in range(4)])
    if k < 3:
        i, j = (k + 1) % 3, (k + 2) % 3
        X[i, i] = X[j, j] = mp.cos(step)
        X[j, i], X[i, j] = mp.sin(step), -mp.sin(step)
    else:
        X[k - 3, 3] = step
    return X


def about_its_origin(motion, X):
    """Return the pose X after a motion whose turn is about the origin of X."""
    result = motion @ X
    result[:3, 3] = X[:3, 3] + motion[:3, 3]
    return result


CURVED_PAIRS = [
    ("ellipsoid", "ellipsoid", 0.05),
    ("ellipsoid", "ellipsoid", -0.01),
    ("ellipsoid", "flat ellipsoid", 0.05),
    ("ellipsoid", "flat ellipsoid", -0.01),
    ("sphere", "ellipsoid", 0.05),
    ("sphere", "ellipsoid", -0.01),
    ("ellipsoid", "cylinder", 0.05),
    ("flat ellipsoid", "disc", 0.05),
    ("capsule", "ellipsoid", 0.05),
]
"""Names and metres. On the side of a capsule or cylinder the reference, which needs a gap that is
smooth in the normal, has no answer; their rims and ends apart have one."""


@pytest.mark.parametrize(("name_A", "name_B", "apart"), CURVED_PAIRS)
def test_derivative_in_high_precision(name_A, name_B, apart):
    """The 6-vectors agree to 1e-11 with central differences that are good to 20 digits.

    Distances are found in 50 digits with a step of 1e-12: what is left of the third derivatives is
    1e-24 times them.
    """
    shapes = CURVED[name_A], CURVED[name_B]
    rng = np.random.default_rng(sum(map(ord, name_A + name_B)))
    compared = 0
    for _ in range(5):
        X_WA = pose(Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3))
        X_WB = pose(Rotation.random(random_state=rng).as_matrix(), X_WA[:3, 3])
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        # Out along a direction until the pair is about as far apart as wanted.
        reach = 0.3
        for _ in range(20):
            X_WB[:3, 3] = X_WA[:3, 3] + reach * direction
            result = distance_of(shapes, X_WA, X_WB)
            reach += apart - result.distance
        if abs(result.distance - apart) > 0.5 * abs(apart):
            continue
        n = X_WA[:3, :3].T @ result.nhat_BA_W
        with mp.workdps(50):
            X_WA, X_WB = (np.vectorize(mp.mpf, otypes=[object])(X) for X in (X_WA, X_WB))
            if _difference(shapes, X_WA, X_WB, n, 3, 0) is None:
                continue
            truth = [
                [_difference(shapes, X_WA, X_WB, n, k, side) for k in range(6)] for side in (0, 1)
            ]
        compared += 1
        # Arms are up to 10 cm long, and a normal is off by no more than a few roundings.
        np.testing.assert_allclose(result.ddistance_dX_WA, np.array(truth[0], float), atol=1e-11)
        np.testing.assert_allclose(result.ddistance_dX_WB, np.array(truth[1], float), atol=1e-11)
    assert compared >= 1


def distance_of(shapes, X_WA, X_WB):
    """Return the pair's signed distance with its derivatives."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("pair")
    ids, poses = [], {}
    for name, shape, X in zip("AB", shapes, (X_WA, X_WB), strict=True):
        frame = scene_graph.register_frame(source, GeometryFrame(name))
        instance = GeometryInstance(np.eye(4), shape, name)
        ids.append(scene_graph.register_geometry(source, frame, instance))
        scene_graph.assign_role(source, ids[-1], ProximityProperties())
        poses[frame] = X
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, poses)
    query = scene_graph.query_object(context)
    return query.compute_signed_distance_pair_closest_points(*ids, derivatives=True)


def _difference(shapes, X_WA, X_WB, n_A, k, side):
    """Return the central difference of the distance by coordinate k of one side, or None."""
    step = mp.mpf(10) ** -12
    values = []
    for sign in (1, -1):
        poses = [X_WA, X_WB]
        poses[side] = about_its_origin(exact_motion(k, sign * step), poses[side])
        R, p = poses[0][:3, :3], poses[0][:3, 3]
        X_AB = np.vstack([np.column_stack([R.T @ poses[1][:3, :3], R.T @ (poses[1][:3, 3] - p)])])
        values.append(reference_near(*shapes, X_AB, n_A))
    if None in values:
        return None
    return (values[0] - values[1]) / (2 * step)


def test_moving_the_whole_scene_changes_nothing():
    """Both derivatives, taken about one point, cancel: the distance does not see the world."""
    rng = np.random.default_rng(3)
    scene_graph = SceneGraph()
    source = scene_graph.register_source("all")
    poses = {}
    for name, (shape, _) in CONVEX.items():
        frame = scene_graph.register_frame(source, GeometryFrame(name))
        instance = GeometryInstance(random_pose(rng, 0.1), shape, name)
        geometry = scene_graph.register_geometry(source, frame, instance)
        scene_graph.assign_role(source, geometry, ProximityProperties())
        poses[frame] = random_pose(rng, 0.2)
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, poses)
    query = scene_graph.query_object(context)
    table = query.compute_signed_distance_pairwise_closest_points(derivatives=True)
    assert len(table) == 28
    for pair in table:
        X_WA, X_WB = query.get_pose_in_world(pair.id_A), query.get_pose_in_world(pair.id_B)
        by_A, by_B = pair.ddistance_dX_WA, pair.ddistance_dX_WB
        assert np.allclose(by_A[3:], -by_B[3:], atol=1e-15, rtol=0.0)
        assert np.allclose(by_A[3:], pair.nhat_BA_W, atol=1e-15, rtol=0.0)
        arm = X_WB[:3, 3] - X_WA[:3, 3]
        turn = by_A[:3] + by_B[:3] + np.cross(arm, by_B[3:])
        assert np.abs(turn).max() <= 1e-14, relative(X_WA, X_WB)


POINTED = ("smooth", "tip", "flat", "cap", "apex", "vertex", "rim")
CROSSING = ("edge", "side")


def is_one_point(case):
    """Tell whether the bodies face each other in one point only, so that turning is smooth."""
    one, other = (part.split(" ", 1)[1] for part in case.label.split(" / ")[:2])
    return one in POINTED or other in POINTED or (one in CROSSING and other in CROSSING)


def _off(distance):
    """Return Complaints (in m/m and m/rad) of derivatives that differ from the constructed."""
    cases = constructed(distance, bodies=CONVEX, rolls=(0.7,))
    cases = [case for case in cases if is_one_point(case)]
    assert len({pair_of(case) for case in cases}) == 35
    query, ids = scene_of(cases)
    # Positions of 1 m are rounded by 1e-16; between the witnesses that turns the normal.
    bound = 1e-10 + 1e-15 / abs(distance)
    found = []
    for case, (id_A, id_B) in zip(cases, ids, strict=True):
        pair = query.compute_signed_distance_pair_closest_points(id_A, id_B, derivatives=True)
        n = case.nhat_BA_W
        p_WCa = case.X_WA[:3, :3] @ case.p_ACa + case.X_WA[:3, 3]
        by_A = np.concatenate([np.cross(p_WCa - case.X_WA[:3, 3], n), n])
        by_B = -np.concatenate([np.cross(p_WCa - case.X_WB[:3, 3], n), n])
        error = np.abs(np.array([pair.ddistance_dX_WA - by_A, pair.ddistance_dX_WB - by_B])).max()
        if not error <= bound:
            found.append(Complaint(float(error), case.label, "derivative", distance))
    return found


@pytest.mark.parametrize("distance", [0.1, 2e-3, 1e-5, -1e-5, -2e-3])
def test_derivative_is_the_one_constructed(distance):
    """A moves away along the normal, and turns about its origin with the contact's arm.

    The truth is a formula of what was constructed: the distance changes at the rate
    ``nhat . (v + omega x r)`` with r from the body's origin to the contact.
    """
    assert _off(distance) == []
