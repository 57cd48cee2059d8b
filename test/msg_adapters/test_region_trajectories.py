"""Trajectories through regions as messages, and what their options say."""

import numpy as np
import pytest

from msg_adapters.errors import MessageError
from msg_adapters.region_trajectories import region_trajectory_to_msg, rules_from_msg
from msg_adapters.robot_configurations import RobotNames
from scene_graph_msgs.msg import RegionTrajectoryOptions
from scene_graph_ros.geometry.optimization import GraphOfConvexSetsOptions
from scene_graph_ros.planning import IrisZoOptions
from scene_graph_ros.planning.trajectories import BezierCurve, CompositeTrajectory


def test_a_trajectory_is_told_in_its_positions():
    """Two curves of order 2 in the positions c and a, of three; numbers are all different."""
    names = RobotNames("position", ("r/a", "r/b", "r/c"), ["r"])
    points = np.arange(12.0).reshape(2, 3, 2)
    points[1, 0] = points[0, -1]
    way = CompositeTrajectory(
        (BezierCurve(0.0, 0.5, points[0]), BezierCurve(0.5, 2.25, points[1]))
    )
    message = region_trajectory_to_msg(
        way, ["first", "second"], names, [2, 0], cost=2.5, lower_bound=2.25, grown="text"
    )
    assert list(message.regions) == ["first", "second"]
    assert message.order == 2
    assert list(message.control_points.names) == ["r/c", "r/a"]
    np.testing.assert_array_equal(message.control_points.positions, points.ravel())
    assert list(message.durations) == [0.5, 1.75]
    assert (message.cost, message.lower_bound, message.gap) == (2.5, 2.25, 0.25)
    assert message.grown == "text"


def test_defaults_are_those_of_planning():
    """What a message says where nobody set it, growing and a search would do by themselves."""
    rules = rules_from_msg(RegionTrajectoryOptions(), "regions")
    for name, value in rules.growing.items():
        assert value == getattr(IrisZoOptions(), name), name
    options = GraphOfConvexSetsOptions()
    assert rules.search == {
        "convex_relaxation": True,
        "max_rounded_paths": 5,
        "max_search_programs": options.max_search_programs,
    }
    assert rules.curves == {
        "order": 3,
        "continuity_order": 1,
        "time_weight": 1.0,
        "length_weight": 0.0,
    }
    assert rules.growth_padding == 0.01


def test_options_come_through():
    """Distinct numbers each."""
    message = RegionTrajectoryOptions(
        epsilon=0.11,
        delta=0.12,
        configuration_space_margin=0.13,
        num_particles=14,
        growth_padding=0.15,
        order=6,
        continuity_order=2,
        time_weight=0.18,
        length_weight=0.19,
        max_rounded_paths=20,
        search=True,
        max_search_programs=22,
    )
    growing, padding, curves, search = rules_from_msg(message, "regions")
    assert list(growing.values()) == [0.11, 0.12, 0.13, 14]
    assert padding == 0.15
    assert list(curves.values()) == [6, 2, 0.18, 0.19]
    assert list(search.values()) == [False, 20, 22]
    # What is made of them is taken.
    IrisZoOptions(**growing)
    GraphOfConvexSetsOptions(**search)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("order", 21),
        ("continuity_order", 4),
        ("epsilon", float("nan")),
        ("delta", 0.0),
        ("length_weight", float("inf")),
        ("max_rounded_paths", 1001),
        ("growth_padding", -1e-9),
    ],
)
def test_what_makes_no_sense_is_named_by_its_field(field, value):
    """And its value."""
    message = RegionTrajectoryOptions(**{field: value})
    with pytest.raises(MessageError, match=rf"^some\.{field} must be .*, not {value:g}"):
        rules_from_msg(message, "some")
