"""How short a path gets for how much is saved, and that turns of a search change nothing."""

import numpy as np
import pytest
from robot_scenes import diagram

from scene_graph_ros.planning import plan_path, PlanningError, SceneGraphCollisionChecker
from scene_graph_ros.planning.parallel import stoppable
from scene_graph_ros.planning.paths.search import path_search

# A ball on two rails, x and y, among three walls with gaps at y = 0.7, -0.7 and 0.7.
CART = """<robot name="cart"><link name="base"/><link name="beam"/><link name="ball">
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="x" type="prismatic"><parent link="base"/><child link="beam"/>
  <axis xyz="1 0 0"/><limit lower="0" upper="4"/></joint>
  <joint name="y" type="prismatic"><parent link="beam"/><child link="ball"/>
  <axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint></robot>"""
WALL = """
  - name: wall_{x}
    source: around
    pose: {{xyz: [{x}, {y}, 0]}}
    shape: {{type: box, size: [0.1, 1.2, 1]}}
"""
WALLS = "geometries:\n" + "".join(
    WALL.format(x=x, y=y) for x, y in ((1, -0.4), (2, 0.4), (3, -0.4))
)
START, GOAL = [0.0, 0.0], [4.0, 0.0]


@pytest.fixture
def checker(tmp_path):
    """Return the cart among its walls."""
    return SceneGraphCollisionChecker(diagram(tmp_path, CART, WALLS))


def test_paths_get_shorter_the_less_a_cut_has_to_save(checker):
    """Cuts come in the same order whatever they have to save, so no path is longer.

    A point's shortest way leads through the walls' edges at y = 0.2, -0.2 and 0.2. The ball's has
    to keep 0.1 away from them and is longer.
    """
    by_saving = []
    for least_saving in (1.0, 0.05, 0.005, 0.0005):
        plan = plan_path(checker, START, GOAL, seed=3, least_saving=least_saving)
        assert plan.is_success
        steps = np.diff(plan.configurations, axis=0)
        assert plan.length == pytest.approx(np.linalg.norm(steps, axis=1).sum(), rel=1e-12)
        by_saving.append(plan.length)
    assert by_saving == sorted(by_saving, reverse=True)
    assert by_saving[0] > by_saving[-1]
    through_edges = [START, (1.0, 0.2), (2.0, -0.2), (3.0, 0.2), GOAL]
    least = np.linalg.norm(np.diff(through_edges, axis=0), axis=1).sum()
    assert least < by_saving[-1] < 1.2 * least


@pytest.mark.parametrize("looks", [2, 40])
def test_a_search_in_short_turns_finds_the_same_path(checker, monkeypatch, looks):
    """After two looks few edges are finished: another thread goes on with them."""
    whole = plan_path(checker, START, GOAL, seed=3)
    monkeypatch.setattr(stoppable, "LOOKS", looks)
    monkeypatch.setattr(path_search, "LOOKS_IN_A_TURN", looks)
    beside, turns = [], stoppable.Turns.beside
    monkeypatch.setattr(
        stoppable.Turns, "beside", lambda self, job: (beside.append(job), turns(self, job))[1]
    )
    plan = plan_path(checker, START, GOAL, seed=3)
    assert plan.configurations.tobytes() == whole.configurations.tobytes()
    assert (plan.edges, plan.least_clearance) == (whole.edges, whole.least_clearance)
    assert bool(beside) == (looks == 2)


@pytest.mark.parametrize("saving", [0.0, 1e-5, 1.5, float("nan"), "much", None])
def test_a_saving_that_means_nothing_is_refused(checker, saving):
    """It is a part of the length, and not so small that there is no end."""
    with pytest.raises(PlanningError, match=r"least_saving must be from 0\.0001 to 1, not"):
        plan_path(checker, START, GOAL, least_saving=saving)
