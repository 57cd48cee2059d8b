"""The retimer that a parameter names, as goals of plan_path get it."""

import sys

import pytest

from msg_adapters.errors import UnavailableError
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.node.services import plan_goals
from scene_graph_ros.trajectories.retimers import retimer_libraries
from scene_graph_ros.trajectories.retimers.named_retimers import as_retimer


def test_all_that_can_be_configured_are_retimers():
    """Each choice of the parameter has one of its own; the default is ours."""
    (parameter,) = (each for each in PARAMETERS if each.name == "retimer")
    kinds = [type(as_retimer(name)).__name__ for name in parameter.choices]
    assert kinds == ["TimeOptimalRetimer", "ToppraRetimer", "RuckigRetimer"]
    assert parameter.default == parameter.choices[0]


def test_one_that_is_missing_makes_goals_unavailable(monkeypatch):
    """A status that names the parameter and what to install, before anything is planned."""
    retimer_libraries.get_ruckig.cache_clear()
    monkeypatch.setitem(sys.modules, "ruckig", None)
    try:
        with pytest.raises(UnavailableError, match=r"^parameter retimer: .*pip install ruckig"):
            plan_goals._retimer("ruckig")
    finally:
        retimer_libraries.get_ruckig.cache_clear()
