"""Boxes of configurations that are proven free, against answers known by construction."""

import math

import numpy as np
import pytest
from robot_scenes import ARM, diagram, DRONE, PLATE, POSTS, ROD, SLIDE

from scene_graph_ros.planning import (
    CertificateError,
    CspaceFreeBox,
    PairCertificate,
    SceneGraphCollisionChecker,
)


def boxes_of(folder, urdf, scene=""):
    """Return the search of a robot in a scene."""
    return CspaceFreeBox(SceneGraphCollisionChecker(diagram(folder, urdf, scene)))


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("arm"), ARM, POSTS))


def test_a_rod_turns_up_to_the_plate_and_no_farther(tmp_path):
    """The plate begins 0.7 m away at 0.5 rad; half its thickness and the rod's are 0.00055 m."""
    search = boxes_of(tmp_path, ROD, PLATE)
    touches = 0.5 - 0.00055 / 0.7
    found = search.find_separation_certificate_given_box([-0.4], [touches - 0.01])
    assert found.is_success, found.failures
    assert found.verify()
    # From 0.7 m on what is between is 0.7 sin(0.01), and no more.
    assert 0.0 < found.distance <= 0.7 * math.sin(0.01)
    assert found.contains(np.array([[-0.4], [touches - 0.01], [0.0]])).all()
    assert not found.contains(np.array([[-0.41], [touches + 0.01]])).any()
    hit = search.find_separation_certificate_given_box([-0.4], [touches + 0.01])
    assert not hit.is_success
    (failure,) = hit.failures.values()
    assert failure.status in ("collision", "no_plane")
    if failure.status == "collision":
        assert touches - 1e-6 <= failure.q[0] <= touches + 0.01
    # The other way round it is free, beyond half a turn from zero as well.
    around = search.find_separation_certificate_given_box([math.pi - 0.5], [math.pi + 0.5])
    assert around.is_success, around.failures


def test_an_arm_is_free_in_a_box_of_its_joints(arm):
    """Proven by planes and by distances; corners and samples, which nobody proved, are free."""
    search = CspaceFreeBox(arm)
    middle, half = np.array([0.05, -0.1]), np.array([0.2, 0.25])
    low, high = middle - half, middle + half
    found = search.find_separation_certificate_given_box(low, high)
    assert found.is_success, found.failures
    assert found.verify()
    corners = np.array([[a, b] for a in (low[0], high[0]) for b in (low[1], high[1])])
    assert found.contains(corners).all()
    inside = np.random.default_rng(5).uniform(low, high, (2000, 2))
    assert found.contains(inside).all()
    assert arm.check_configs_collision_free(np.concatenate([corners, inside])).all()
    nearest = min(
        arm.calc_robot_clearance(q, 5.0).distances.min(initial=5.0) for q in inside[:200]
    )
    assert 0.0 < found.distance <= nearest + 1e-12
    by_distances = search.certify_by_distances(low, high)
    assert by_distances.status == "proven" and by_distances.verify()
    pair = search.geometry_pairs[0]
    assert isinstance(search.find_pair_certificate(pair, low, high), PairCertificate)


def test_what_collides_in_a_box_is_told_and_may_be_ignored(arm):
    """With the configuration, which is in the box and collides for the checker, too."""
    search = CspaceFreeBox(arm)
    low, high = np.array([-1.5, -0.2]), np.array([1.5, 0.2])
    found = search.find_separation_certificate_given_box(low, high, terminate_at_failure=False)
    assert not found.is_success and not found.verify()
    hits = {pair: each for pair, each in found.failures.items() if each.status == "collision"}
    assert hits
    for each in hits.values():
        assert (low <= each.q).all() and (each.q <= high).all()
        assert not arm.check_config_collision_free(each.q)
    spared = search.find_separation_certificate_given_box(low, high, list(search.geometry_pairs))
    assert spared.is_success and not spared.certificates


@pytest.mark.parametrize(
    ("lower", "upper", "words"),
    [
        ([0.0], [1.0, 1.0], r"q_box_lower must be 2 finite numbers, not \[0.0\]"),
        ([0.0, 0.0], [1.0, np.inf], "q_box_upper must be 2 finite numbers"),
        ([0.0, "a"], [1.0, 1.0], "q_box_lower must be 2 finite numbers"),
        ([0.0, 0.5], [1.0, 0.5], "q_box_upper must be above q_box_lower; of '.*' they are 0.5"),
        ([-4.0, 0.0], [4.0, 1.0], "must be less than half a turn"),
    ],
)
def test_a_box_that_makes_no_sense_is_named(arm, lower, upper, words):
    """By which end, which position, and what it is."""
    with pytest.raises(CertificateError, match=words):
        CspaceFreeBox(arm).find_separation_certificate_given_box(lower, upper)


def test_robots_that_have_no_tangents_are_refused(tmp_path):
    """A drone floats; a ball on a rail slides, and its box is one of s itself."""
    (tmp_path / "rail").mkdir()
    with pytest.raises(CertificateError, match="planar or floating"):
        boxes_of(tmp_path, DRONE)
    found = boxes_of(tmp_path / "rail", SLIDE).find_separation_certificate_given_box([-1], [1])
    assert found.is_success
