"""Tables of clearances: every kind of joint, many checkers and threads, rows that are appended."""

from concurrent.futures import ThreadPoolExecutor
import itertools

import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, SLIDE

from scene_graph_ros.planning import (
    CollisionCheckerError,
    RobotClearance,
    RobotCollisionType,
    SceneGraphCollisionChecker,
)

_BOX = '<collision><geometry><box size="0.3 0.2 0.1"/></geometry></collision>'
# It rolls on a plane, turns about y, slides along x; a finger slides half as far the other way.
WAGON = f"""<robot name="wagon"><link name="ground"/><link name="car">{_BOX}</link>
  <link name="boom">{_BOX}</link><link name="tip">{_BOX}</link><link name="finger">{_BOX}</link>
  <joint name="drive" type="planar"><parent link="ground"/><child link="car"/>
  <origin rpy="0.1 0.2 0.3"/><axis xyz="0 0 1"/></joint>
  <joint name="swing" type="continuous"><parent link="car"/><child link="boom"/>
  <origin xyz="0.1 0 0.5" rpy="0.3 0 0.2"/><axis xyz="0 1 0"/></joint>
  <joint name="reach" type="prismatic"><parent link="boom"/><child link="tip"/>
  <origin xyz="0.6 0 0"/><axis xyz="1 0 0"/><limit lower="-1" upper="1"/></joint>
  <joint name="follow" type="prismatic"><parent link="boom"/><child link="finger"/>
  <origin xyz="-0.6 0 0"/><axis xyz="1 0 0"/><limit lower="-1" upper="1"/>
  <mimic joint="reach" multiplier="-0.5" offset="0.01"/></joint></robot>"""
POST = """
geometries:
  - name: post
    source: around
    pose: {xyz: [0.9, 0.7, 0.8], rpy: [0.3, 0.2, 0.1]}
    shape: {type: ellipsoid, semi_axes: [0.2, 0.1, 0.3]}
"""


@pytest.mark.parametrize(
    ("urdf", "q"),
    [
        (WAGON, [0.2, -0.1, 0.4, 0.3, 0.2]),
        (DRONE, [0.9, 0.2, -0.3, 0.1, 0.4, 0.3, 0.5]),
    ],
    ids=["planar_revolute_prismatic_mimic", "floating"],
)
def test_derivatives_of_every_kind_of_joint(tmp_path, urdf, q):
    """Central differences of convex bodies, which have one nearest pair of points, to 1e-8.

    Their error is a third derivative times 1e-10 / 6, and distances' rounding divided by 2e-5.
    """
    checker = SceneGraphCollisionChecker(diagram(tmp_path, urdf, POST))
    q, step = np.array(q), 1e-5
    found = checker.calc_robot_clearance(q, 3.0)
    around = [k for k, kind in enumerate(found.collision_types) if kind.value == 1]
    assert around
    for column in range(len(q)):
        ends = []
        for sign in (1.0, -1.0):
            moved = q.copy()
            moved[column] += sign * step
            there = checker.calc_robot_clearance(moved, 3.5)
            ends.append(dict(zip(there.pairs, there.distances, strict=True)))
        slopes = [(ends[0][p] - ends[1][p]) / (2.0 * step) for p in found.pairs]
        off = np.abs(found.jacobians[:, column] - slopes)
        assert off[around].max() < 1e-8


def test_checkers_in_turn_and_threads_at_once_keep_apart(tmp_path):
    """A ball on a rail at x is |x - 1| - 0.3 from another one, less what has to be kept."""
    robot = diagram(tmp_path, SLIDE, BALL)
    paddings = [0.0, 0.05, -0.05]
    checkers = [SceneGraphCollisionChecker(robot, env_collision_padding=p) for p in paddings]

    def look(first):
        for k in range(first, first + 300):
            x, which = -0.01 * k, k % 3
            found = checkers[which].calc_robot_clearance([x], 9.0)
            np.testing.assert_allclose(found.distances, [0.7 - x - paddings[which]], atol=1e-14)
            np.testing.assert_array_equal(found.jacobians, [[-1.0]])
        return found

    with ThreadPoolExecutor(2) as pool:
        kept = list(pool.map(look, range(4)))
    # What was told before is not written over by what was asked since.
    for first, found in enumerate(kept):
        x, which = -0.01 * (first + 299), (first + 299) % 3
        np.testing.assert_allclose(found.distances, [0.7 - x - paddings[which]], atol=1e-14)


def test_rows_are_appended_to_what_was_found(tmp_path):
    """And whom the first ones are about stays as it was."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    found = checker.calc_robot_clearance([0.0], 9.0)
    assert found.size == 1
    kind = RobotCollisionType.SELF_COLLISION
    found.append(0, 1, kind, 0.25, [2.0])
    (pair, none), robots = found.pairs, found.robot_indices
    names = {checker.model.context.snapshot.inspector.get_name(each) for each in pair}
    assert "ball" in names and none is None and found.size == 2 and len(robots) == 2
    assert found.collision_types == (RobotCollisionType.ENVIRONMENT_COLLISION, kind)
    np.testing.assert_allclose(found.distances, [0.7, 0.25], atol=1e-15)
    np.testing.assert_array_equal(found.jacobians, [[-1.0], [2.0]])


def test_many_configurations_have_the_tables_of_each(tmp_path):
    """Bit for bit, also where a table is full long before all are told; of none there are none."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, WAGON, POST))
    q = np.random.default_rng(3).uniform(-0.5, 0.5, (1500, checker.model.tree.num_positions))
    tables = checker.calc_robot_clearances(q, 3.0)
    assert len(tables) == len(q)
    assert sum(table.size for table in tables) > 4000
    for table, each in list(zip(tables, q, strict=True))[::7]:
        alone = checker.calc_robot_clearance(each, 3.0)
        assert table.pairs == alone.pairs
        np.testing.assert_array_equal(table.distances, alone.distances)
        np.testing.assert_array_equal(table.jacobians, alone.jacobians)
    assert checker.calc_robot_clearances(q[:0], 3.0) == []
    columns = checker.calc_clearance_columns(q, 3.0)
    sizes = [table.size for table in tables]
    np.testing.assert_array_equal(columns.configuration, np.repeat(np.arange(len(q)), sizes))
    for name, of_tables in (("distance", "distances"), ("jacobian", "jacobians")):
        told = np.concatenate([getattr(table, of_tables) for table in tables])
        np.testing.assert_array_equal(getattr(columns, name), told)
    pairs = [sorted(map(int, pair)) for table in tables for pair in table.pairs]
    np.testing.assert_array_equal(np.stack([columns.id_A, columns.id_B], axis=1), pairs)
    types = [each.value for table in tables for each in table.collision_types]
    np.testing.assert_array_equal(columns.collision_type, types)
    assert len(set(types)) == 2
    assert [len(each) for each in checker.calc_clearance_columns(q[:0], 3.0)] == [0] * 6


def test_clearance_tables_grow():
    """Rows may be appended; what is there is read-only but by its own name."""
    table = RobotClearance(2)
    assert table.size == 0 and table.num_positions == 2 and table.jacobians.shape == (0, 2)
    table.reserve(1)
    for row in range(20):
        table.append(1, row, RobotCollisionType.SELF_COLLISION, 0.1 * row, [row, -row])
    assert table.size == 20 and table.robot_indices == (1,) * 20
    assert table.other_indices == tuple(range(20))
    np.testing.assert_array_equal(table.distances, 0.1 * np.arange(20))
    table.mutable_jacobians[3] = 7.0
    np.testing.assert_array_equal(table.jacobians[3:5], [[7.0, 7.0], [4.0, -4.0]])
    with pytest.raises(ValueError, match="read-only"):
        table.jacobians[0] = 1.0
    kind = RobotCollisionType.SELF_COLLISION
    with pytest.raises(CollisionCheckerError, match=r"jacobian must have shape \(2,\), not \(3,"):
        table.append(0, 1, kind, 0.0, [0.0] * 3)
    with pytest.raises(CollisionCheckerError, match="collision_type must be a RobotCollisionType"):
        table.append(0, 1, 2, 0.0, [0.0] * 2)


def test_kinds_of_collisions_may_be_updated():
    """One or both, from each of the four."""
    for value, around, own in itertools.product(range(4), *[(None, True, False)] * 2):
        kind = RobotCollisionType(value)
        new = kind.make_updated(in_environment_collision=around, in_self_collision=own)
        assert bool(new.value & 1) == (bool(value & 1) if around is None else around)
        assert bool(new.value & 2) == (bool(value & 2) if own is None else own)
