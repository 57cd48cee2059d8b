"""The node's services and its action, without a node."""

from __future__ import annotations

from typing import Any
from unittest.mock import Mock

from builtin_interfaces.msg import Time

from scene_graph_msgs.msg import Status
import scene_graph_msgs.srv
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.node.services.plan_action import PlanAction
from scene_graph_ros.node.services.queries import QUERIES
from scene_graph_ros.node.services.request_counts import RequestCounts
from scene_graph_ros.node.services.services import Services
from scene_graph_ros.node.world.edits import EDITS, Tools
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World
from service_requests.odd_fields import assert_finite

__all__ = ["Host", "ask", "offer"]

LIMITS = {
    "max_rows_per_response": 1000,
    "max_points_per_request": 1000,
    "max_pixels_per_request": 1000,
    "max_planning_time": 0.05,
    "plan_from_unreported": True,
}
KEPT = "kept: {A: [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]], b: [9, 9, 9, -26]}"


class Host:
    """What the node is to its services, without one."""

    def __init__(self) -> None:
        self.node = self
        self.failures: list[str] = []
        self.recorder = self.channels = None
        self.kept: Any = None
        self.world: Any = None
        self.plans: list[Any] = []
        self.values = {parameter.name: parameter.default for parameter in PARAMETERS} | LIMITS

    def get_clock(self) -> Any:
        """Return the node's clock, which tells how old states are: some steady time."""
        return Mock(now=lambda: Mock(nanoseconds=0))

    def parameter(self, name: str) -> Any:
        return self.values[name]

    def scene_changed(self) -> None:
        """Subscribe to nothing."""

    def pose_topics(self, snapshot: Any) -> dict[str, str]:
        return {}

    def configuration_topics(self, snapshot: Any) -> dict[str, str]:
        class Topics(dict):
            def __missing__(self, name: str) -> str:
                return f"/{name}/configurations"

        return Topics()

    def regions(self) -> Any:
        from scene_graph_ros.node.world.kept_regions import KeptRegions

        if self.kept is None:
            self.kept = KeptRegions(lambda: self.world.snapshot, lambda count: None)
        return self.kept

    def plan_found(self, path: Any) -> None:
        self.plans.append(path)

    def is_running(self) -> bool:
        return False

    def lack_of_kernels(self, group: str) -> str:
        return ""

    def get_logger(self) -> Host:
        return self

    def error(self, text: str) -> None:
        self.failures.append(text)

    warning = info = error


def offer(world: World, host: Host) -> Services:
    """Return the services without the middleware."""
    loader = SceneLoader("", message_type, EFFECT_NAMES)
    services = object.__new__(Services)
    services._host, services._world = host, world
    services._effects = Mock()  # what is published is not tried here
    services._tools = Tools(loader.resolve, message_type, loader.load_request, loader.text)
    services.counts = RequestCounts()
    host.world = world
    kept = ask(services, "LoadRegions", scene_graph_msgs.srv.LoadRegions.Request(text=KEPT))
    assert kept.status.code == Status.OK
    return services


def ask(services: Services, name: str, request: Any) -> Any:
    """Return the response to a request, or the result of a goal."""
    if name == "PlanPath":
        action = object.__new__(PlanAction)
        action._host, action._world = services._host, services._world
        action._refuse, action._answered = services._refuse, services._plan_answered
        action._text = services._tools.scene_text
        goal = Goal(bytes(16), request, Time(), lambda goal, feedback: assert_finite(feedback))
        return action._plan(goal).result
    if name in QUERIES:
        answers: list[Any] = []
        services._query_callback(name)(request, answers.append)
        return answers[0]
    assert name in EDITS
    return services._edit_callback(name)(request, getattr(scene_graph_msgs.srv, name).Response())
