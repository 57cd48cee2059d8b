"""Regions that are proven free by distances, against answers known by construction."""

from dataclasses import replace

import numpy as np
import pytest
from robot_scenes import ARM, BALL, diagram, DRONE, POSTS, SLIDE

from scene_graph_ros.geometry.optimization import HPolyhedron
from scene_graph_ros.planning import (
    CertificateError,
    certify_by_distances,
    CspaceFreePolytope,
    load_robot_diagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.certified.motion_reaches import motion_reaches

BOX = np.concatenate([np.eye(2), -np.eye(2)])


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("arm"), ARM, POSTS))


@pytest.fixture(scope="module")
def proven(arm):
    """A region with a slanted side, which cuts off what is not free."""
    region = HPolyhedron(np.vstack([BOX, [1.0, 1.0]]), [0.4, 0.4, 0.9, 0.9, 0.45])
    return certify_by_distances(arm, region)


def test_a_region_with_a_slanted_side_is_proven(arm, proven):
    """Boxes cover it, some are left out, and a sampler finds nothing in it."""
    assert proven.is_success and proven.verify() and proven.open_share == 0.0
    assert sum(len(level.outside) for level in proven.levels) > 0
    q = np.random.default_rng(2).uniform(-0.9, 0.4, (20_000, 2))
    inside = q[proven.grid.contains(q)]
    assert len(inside) > 5000
    assert arm.check_configs_collision_free(inside).all()
    centers, halves = proven.boxes
    assert len(centers) == proven.num_boxes > 10
    for point in inside[:500]:
        assert (np.abs(point - centers) <= halves * (1.0 + 1e-9)).all(axis=1).any()


def test_a_region_of_tangents_is_proven(arm):
    """The same region of s as by planes, and its boxes in q."""
    search = CspaceFreePolytope(arm, [0.2, -0.3])
    C, d = np.vstack([BOX, [1.0, 1.0]]), np.array([0.15, 0.2, 0.2, 0.2, 0.25])
    planes = search.find_separation_certificate_given_polytope(C, d)
    boxes = search.certify_by_distances(C, d)
    assert planes.is_success and boxes.is_success
    assert planes.verify() and boxes.verify()
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (5000, 2))
    np.testing.assert_array_equal(planes.contains(q), boxes.grid.contains(q))


@pytest.mark.parametrize("padding", [0.0, 0.05])
def test_a_ball_on_a_rail_is_proven_up_to_the_other(tmp_path, padding):
    """A ball of 0.1 m meets one of 0.2 m at 1 m from 0.7 m on; less where there is padding."""
    rail = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    rail.set_padding_all_robot_environment_pairs(padding)
    end = 0.7 - padding
    found = certify_by_distances(rail, HPolyhedron.make_box([-2.0], [end - 1e-6]))
    assert found.is_success and found.verify() and found.num_boxes < 60
    beyond = certify_by_distances(rail, HPolyhedron.make_box([-2.0], [end + 1e-6]))
    assert beyond.status == "collision" and not beyond.verify()
    assert end <= beyond.q[0] <= end + 1e-6


def test_collisions_are_never_certified(arm):
    """A region with a collision is refused with one, however few boxes there are."""
    found = certify_by_distances(arm, HPolyhedron.make_box([-0.5, -0.5], [0.6, 0.6]))
    assert not found.is_success and found.status == "collision" and not found.verify()
    assert found.grid.contains(found.q[np.newaxis]).all()
    assert not arm.check_config_collision_free(found.q)
    assert "it collides at" in found.reason


def test_what_boxes_do_not_suffice_for_is_undecided(arm, proven):
    """The share that is left open is told; that is no success."""
    few = certify_by_distances(arm, proven.grid.region.polyhedron, max_boxes=20)
    assert few.status == "undecided" and not few.is_success and not few.verify()
    assert 0.0 < few.open_share < 1.0 and "max_boxes is 20" in few.reason


def test_motions_are_bounded(arm):
    """No corner of a link moves farther, seen from the other body, than its reach times dq."""
    half = np.array([0.3, 0.2])
    reaches = motion_reaches(arm.plan, -half, half)
    tree, bodies = arm.plan.tree, arm.plan.bodies
    generator = np.random.default_rng(6)
    corners = np.array([[x, y, 0.05, 1.0] for x in (0.1, 0.9) for y in (-0.05, 0.05)])
    for p, (a, b) in enumerate(arm.plan.pairs.bodies):
        link = arm.plan.owners[a]
        other = arm.plan.owners[b] if b < len(bodies.joints) else -1
        moved = []
        dq = generator.uniform(-1.0, 1.0, (200, 2)) * half
        for q in (np.zeros((200, 2)), dq):
            X_WL = tree.link_poses(q)
            X_OL = X_WL[:, link]
            if other >= 0:
                X_OL = np.linalg.inv(X_WL[:, other]) @ X_OL
            moved.append(corners @ X_OL.transpose(0, 2, 1))
        ways = np.linalg.norm(moved[1] - moved[0], axis=2).max(axis=1)
        assert (ways <= np.abs(dq) @ reaches[p] + 1e-12).all()
        assert ways.max() > 0.2 * (half @ reaches[p])


def first_level(certificate):
    """Return the first level with a proven box."""
    return next(k for k, level in enumerate(certificate.levels) if len(level.proven))


def with_level(certificate, k, level):
    """Return a certificate with one level replaced."""
    levels = (*certificate.levels[:k], level, *certificate.levels[k + 1 :])
    return replace(certificate, levels=levels)


def test_a_changed_certificate_is_found(proven):
    """A box left out, put elsewhere, made larger, or called outside shows nothing any more."""
    k = first_level(proven)
    level = proven.levels[k]
    others = [
        replace(level, proven=level.proven[1:]),
        replace(level, proven=level.proven + 1),
        replace(level, halvings=level.halvings - 1),
        replace(
            level, proven=level.proven[1:], outside=np.vstack([level.outside, level.proven[:1]])
        ),
    ]
    assert with_level(proven, k, level).verify()
    for other in others:
        assert not with_level(proven, k, other).verify()
    wider = replace(proven.grid.region, upper=np.array([0.7, 0.4]))
    assert not replace(proven, grid=replace(proven.grid, region=wider)).verify()
    # All boxes at once, of which the first is too large.
    root = replace(proven.levels[0], proven=np.zeros((1, 2), dtype=np.int64))
    assert not replace(proven, levels=(root,), split=()).verify()


def test_all_pairs_of_a_panda_among_many_things_are_proven():
    """Seven joints and a finger in the demo's cell; nothing collides at random configurations."""
    robots = load_robot_diagram("config/scenes/panda_cell.yaml")
    checker = SceneGraphCollisionChecker(robots)
    q = np.array([-0.5, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.02])
    half = np.array([*[0.02] * 7, 0.01])
    found = certify_by_distances(checker, HPolyhedron.make_box(q - half, q + half))
    assert found.status == "proven", found.reason
    assert checker.num_pairs > 400
    assert found.verify()
    inside = np.random.default_rng(0).uniform(q - half, q + half, (500, 8))
    assert all(checker.check_configs_collision_free(inside))
    wide = np.array([*[0.08] * 7, 0.01])
    larger = HPolyhedron.make_box(q - wide, q + wide)
    assert certify_by_distances(checker, larger, max_boxes=10_000).status == "collision"


def test_bad_arguments_are_named(arm, tmp_path):
    """Each message says which argument, and what it was."""
    box = HPolyhedron.make_box([-0.1, -0.1], [0.1, 0.1])
    with pytest.raises(CertificateError, match="checker must be a SceneGraphCollisionChecker"):
        certify_by_distances(arm.plan, box)
    with pytest.raises(CertificateError, match="region must be an HPolyhedron"):
        certify_by_distances(arm, BOX)
    with pytest.raises(CertificateError, match=r"shapes \(m, 2\)"):
        certify_by_distances(arm, HPolyhedron.make_unit_box(3))
    with pytest.raises(CertificateError, match="max_boxes must be a positive whole number"):
        certify_by_distances(arm, box, max_boxes=0)
    with pytest.raises(CertificateError, match="no point in common"):
        certify_by_distances(arm, HPolyhedron.make_box([4.0, 0.0], [5.0, 1.0]))
    drone = SceneGraphCollisionChecker(diagram(tmp_path, DRONE, BALL))
    with pytest.raises(CertificateError, match="'free' is planar or floating"):
        certify_by_distances(drone, HPolyhedron.make_unit_box(7))
