"""A checker whose edit is interrupted is the one before it or the one after it."""

from interrupting import instruction_count, interrupted_at, places
import numpy as np
import pytest
from robot_scenes import SLIDE

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker

EDITS = {
    "add a shape": lambda c: c.add_collision_shape_to_body("more", c.bodies[0], Sphere(0.4), FAR),
    "remove all shapes": lambda c: c.remove_all_added_collision_shapes(),
    "padding between": lambda c: c.set_padding_between(c.bodies[0], c.bodies[1], 0.1),
    "padding of all": lambda c: c.set_padding_all_robot_robot_pairs(0.3),
    "filter": lambda c: c.set_collision_filtered_between(c.bodies[0], c.bodies[1], True),
    "filter all": lambda c: c.set_collision_filtered_with_all_bodies(c.bodies[0]),
}
FAR = np.eye(4)
FAR[0, 3] = 0.5


@pytest.fixture(scope="module", name="checker")
def _checker(tmp_path_factory):
    """Two balls on one rail, each of a robot, with a shape that was added."""
    folder = tmp_path_factory.mktemp("slides")
    (folder / "slide.urdf").write_text(SLIDE)
    (folder / "two.yaml").write_text(
        "version: 1\nrobots:\n  - {name: left, urdf: slide.urdf}\n"
        "  - {name: right, urdf: slide.urdf}\n"
    )
    checker = SceneGraphCollisionChecker(load_robot_diagram(folder / "two.yaml"))
    checker.add_collision_shape_to_body("some", checker.bodies[1], Sphere(0.2), FAR)
    return checker


def answers(checker):
    """Return all that a checker says of its bodies, shapes, paddings, filters and of places."""
    rng = np.random.default_rng(1)
    q = rng.uniform(-2.0, 2.0, (40, checker._tree.num_positions))
    added = checker.get_all_added_collision_shapes()
    return (
        {group: [repr(each.shape) for each in shapes] for group, shapes in added.items()},
        checker.get_padding_matrix().tolist(),
        checker.get_filtered_collision_matrix().tolist(),
        checker.get_largest_padding(),
        checker.check_configs_collision_free(q).tolist(),
        checker.calc_robot_clearance(q[0], 9.0).distances.tolist(),
        checker.num_pairs,
    )


@pytest.mark.search
@pytest.mark.parametrize("name", EDITS)
def test_an_interrupted_edit_is_done_or_not(checker, name):
    """All answers are those of one of the two checkers, and the edit can then be made."""
    edit, before = EDITS[name], answers(checker)
    copy = checker.clone()
    count = instruction_count(lambda: edit(copy))
    after = answers(copy)
    assert after != before
    for at in places(count, name):
        copy = checker.clone()
        interrupted_at(lambda copy=copy: edit(copy), at)
        found = answers(copy)
        if found == before:
            edit(copy)
            found = answers(copy)
        assert found == after, at
