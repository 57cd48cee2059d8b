import numpy as np
import pytest
from scipy.spatial.transform import Rotation

_SEEDS = range(6)


def _pairs(table):
    return list(zip(table.id_A.tolist(), table.id_B.tolist(), strict=True))


@pytest.mark.parametrize("seed", _SEEDS)
def test_penetration_distance_candidates_and_collision_agree(make_scene, seed):
    """A pair penetrates iff its distance is negative, and then it is a candidate."""
    scene = make_scene()
    scene.scatter(seed)
    query = scene.query
    contacts = query.compute_point_pair_penetration()
    distances = query.compute_signed_distance_pairwise_closest_points()
    negative = distances.distance < -1e-15
    assert len(distances) == 14 * 13 / 2 + 14
    assert _pairs(contacts) == [p for p, n in zip(_pairs(distances), negative, strict=True) if n]
    assert np.array_equal(contacts.depth, -distances.distance[negative])
    assert np.array_equal(contacts.nhat_BA_W, distances.nhat_BA_W[negative])
    assert query.has_collisions() is (len(contacts) > 0)
    assert set(_pairs(contacts)) <= set(_pairs(query.find_collision_candidates()))


@pytest.mark.parametrize("max_distance", [0.0, 0.05, 0.2])
def test_limited_distance_is_a_part_of_the_unlimited_one(make_scene, max_distance):
    """A limit leaves out pairs, and changes nothing about the others."""
    scene = make_scene()
    scene.scatter(11)
    everything = scene.query.compute_signed_distance_pairwise_closest_points()
    near = scene.query.compute_signed_distance_pairwise_closest_points(max_distance)
    keep = everything.distance <= max_distance
    assert 0 < keep.sum() < len(everything)
    assert _pairs(near) == [p for p, k in zip(_pairs(everything), keep, strict=True) if k]
    for name in near.columns:
        assert np.allclose(near.columns[name], everything.columns[name][keep], atol=1e-9), name


@pytest.mark.parametrize("seed", _SEEDS)
def test_invariants_of_results(make_scene, seed):
    """Sorted by ids; witnesses, normal and distance fit; the normal is a unit vector."""
    scene = make_scene()
    scene.scatter(seed)
    distances = scene.query.compute_signed_distance_pairwise_closest_points()
    assert _pairs(distances) == sorted(_pairs(distances))
    assert (distances.id_A < distances.id_B).all()
    for record in distances:
        X_WA = scene.query.get_pose_in_world(record.id_A)
        X_WB = scene.query.get_pose_in_world(record.id_B)
        p_WCa = X_WA[:3, :3] @ record.p_ACa + X_WA[:3, 3]
        p_WCb = X_WB[:3, :3] @ record.p_BCb + X_WB[:3, 3]
        assert p_WCa - p_WCb == pytest.approx(record.distance * record.nhat_BA_W, abs=1e-12)
        assert np.linalg.norm(record.nhat_BA_W) == pytest.approx(1.0, abs=1e-12)
    for contact in scene.query.compute_point_pair_penetration():
        assert contact.depth > 0.0
        gap = contact.p_WCb - contact.p_WCa
        assert gap @ contact.nhat_BA_W == pytest.approx(contact.depth, abs=1e-12)


def test_results_are_the_same_each_time(make_scene):
    """Two scenes registered alike give the same numbers, to the last bit."""
    tables = []
    for _ in range(2):
        scene = make_scene()
        scene.scatter(5)
        tables.append(scene.query.compute_signed_distance_pairwise_closest_points())
    for name in ("distance", "p_ACa", "p_BCb", "nhat_BA_W"):
        assert np.array_equal(tables[0].columns[name], tables[1].columns[name]), name


def _moved(X, twist, t):
    """Return X moved by the twist (angular; of its origin), both in W, for a time t."""
    result = X.copy()
    result[:3, :3] = Rotation.from_rotvec(t * twist[:3]).as_matrix() @ X[:3, :3]
    result[:3, 3] += t * twist[3:]
    return result


@pytest.mark.parametrize("seed", _SEEDS)
def test_derivatives_predict_the_change_of_distance(make_scene, seed):
    """Central differences along random motions of both bodies give the stated derivatives."""
    scene = make_scene(copies=1, floor=True)
    scene.scatter(seed, side=1.0)
    rng = np.random.default_rng(seed)
    table = scene.query.compute_signed_distance_pairwise_closest_points(derivatives=True)
    base = [scene.query.get_pose_in_world(f) for f in scene.frames]
    twists = rng.normal(size=(len(scene.frames), 6))
    step = 1e-6
    ends = []
    for t in (-step, step):
        moved = np.array([_moved(X, v, t) for X, v in zip(base, twists, strict=True)])
        scene.context.set_frame_poses(scene.source, moved)
        ends.append(scene.query.compute_signed_distance_pairwise_closest_points().distance)
    measured = (ends[1] - ends[0]) / (2.0 * step)
    row = {int(i): k for k, i in enumerate(scene.ids)}
    checked = 0
    for k, record in enumerate(table):
        twist_A = twists[row[int(record.id_A)]]
        b = row[int(record.id_B)]
        twist_B = twists[b] if b < len(twists) else np.zeros(6)  # the floor stands still
        predicted = record.ddistance_dX_WA @ twist_A + record.ddistance_dX_WB @ twist_B
        # Smooth pairs follow to the difference's error; deep ones may switch features.
        if record.is_nhat_BA_W_unique and record.distance > 0.0:
            assert predicted == pytest.approx(measured[k], abs=1e-4), record
            checked += 1
    assert checked > 5


def test_derivatives_ride_on_the_same_numbers(make_scene):
    """Asking for derivatives adds their columns, for penetrations too, and changes no other."""
    scene = make_scene()
    scene.scatter(3)
    plain = scene.query.compute_point_pair_penetration()
    rich = scene.query.compute_point_pair_penetration(derivatives=True)
    assert set(rich.columns) - set(plain.columns) == {
        "ddistance_dX_WA",
        "ddistance_dX_WB",
        "dp_WCa_dX_WA",
        "dp_WCa_dX_WB",
        "dp_WCb_dX_WA",
        "dp_WCb_dX_WB",
        "is_witness_differentiable",
    }
    assert rich[0].dp_WCa_dX_WA.shape == (3, 6)
    assert isinstance(rich[0].is_witness_differentiable, bool)
    assert np.array_equal(plain.depth, rich.depth)
    # Moving both bodies alike changes nothing: the linear parts cancel.
    assert np.allclose(rich.ddistance_dX_WA[:, 3:], -rich.ddistance_dX_WB[:, 3:])


@pytest.mark.parametrize("offset", [1.0, 1e3])
def test_moving_the_whole_scene_changes_no_distance(make_scene, offset):
    """A common rigid motion keeps distances and witnesses in the bodies' frames."""
    scene = make_scene(floor=False)
    scene.scatter(8)
    before = scene.query.compute_signed_distance_pairwise_closest_points()
    X_VW = np.eye(4)
    X_VW[:3, :3] = Rotation.random(rng=np.random.default_rng(1)).as_matrix()
    X_VW[:3, 3] = offset
    X_WF = np.array([scene.query.get_pose_in_world(f) for f in scene.frames])
    scene.context.set_frame_poses(scene.source, X_VW @ X_WF)
    after = scene.query.compute_signed_distance_pairwise_closest_points()
    assert np.allclose(before.distance, after.distance, rtol=0.0, atol=1e-12 * (1 + offset))
