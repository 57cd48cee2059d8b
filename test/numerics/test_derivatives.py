"""Derivatives of the distance against central differences of the distance itself."""

import functools

from hard_corpus.batches import Complaint, relative
from hard_corpus.constructed import BODIES, constructed, pair_of, random_pose
from hard_corpus.known_faults import judged, KnownFault, outcomes
from hard_corpus.scenes import scene_of
from hard_corpus.sites import pose
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


RIMS: list[KnownFault] = []


@functools.cache
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


@pytest.mark.parametrize(("distance", "fault"), outcomes([0.1, 2e-3, 1e-5, -1e-5, -2e-3], RIMS))
def test_derivative_is_the_one_constructed(distance, fault):
    """A moves away along the normal, and turns about its origin with the contact's arm.

    The truth is a formula of what was constructed: the distance changes at the rate
    ``nhat . (v + omega x r)`` with r from the body's origin to the contact.
    """
    assert judged(_off(distance), distance, fault, RIMS) == []
