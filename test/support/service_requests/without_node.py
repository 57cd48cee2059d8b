"""The node's services and its action, without a node."""

from __future__ import annotations

from typing import Any, NamedTuple
from unittest.mock import Mock

from builtin_interfaces.msg import Time

from msg_adapters.queries import NO_OPTIONS
from scene_graph_msgs.msg import Status
import scene_graph_msgs.srv
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.node.services.edit_answers import EditAnswers, EditHooks
from scene_graph_ros.node.services.plan_action import PlanAction, PlanHooks
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.services.query_answers import QueryAnswers
from scene_graph_ros.node.services.replies import Replies
from scene_graph_ros.node.services.waiting import Waiting
from scene_graph_ros.node.world.edits import EDITS, Tools
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.regions_on_demand import RegionsOnDemand
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
    """A node's parameters, clock and logger, without one."""

    def __init__(self) -> None:
        self.failures: list[str] = []
        self.plans: list[Any] = []
        self.values = {parameter.name: parameter.default for parameter in PARAMETERS} | LIMITS

    def get_clock(self) -> Any:
        """Return the node's clock, which tells how old states are: some steady time."""
        return Mock(now=lambda: Mock(nanoseconds=0))

    def parameter(self, name: str) -> Any:
        return self.values[name]

    def create_publisher(self, *args: Any, **kwargs: Any) -> Any:
        """Publish to nobody."""
        return Mock()

    def get_logger(self) -> Host:
        return self

    def error(self, text: str) -> None:
        self.failures.append(text)

    warning = info = error


class OfferedServices(NamedTuple):
    """The answers of the services and of the action."""

    queries: QueryAnswers
    edits: EditAnswers
    plans: PlanAction


def offer(world: World, host: Host) -> OfferedServices:
    """Return the services without the middleware."""
    loader = SceneLoader("", message_type, EFFECT_NAMES)
    tools = Tools(loader.resolve, message_type, loader.load_request, loader.text)
    kept = RegionsOnDemand(lambda: world.snapshot, lambda count: None)
    replies = Replies(world, host)
    queries = QueryAnswers(
        lambda: QueryScope(
            world.snapshot, NO_OPTIONS, host.parameter, topics_of, kept.made, loader.text
        ),
        Waiting(world, lambda: False, post=Mock(), set_alarm=Mock()),
        replies,
        parameter=host.parameter,
        lack_of_kernels=lambda group: "",
        record=lambda effect, seconds: None,
    )
    hooks = EditHooks(lambda snapshot: None, lambda: None, lambda: None, topics_of)
    edits = EditAnswers(world, tools, replies, hooks, parameter=host.parameter, logger=host)
    plans = PlanAction(
        host,
        world,
        Mock(),
        replies,
        PlanHooks(loader.text, host.plans.append, lambda seconds: None, lambda group: ""),
        parameter=host.parameter,
    )
    services = OfferedServices(queries, edits, plans)
    response = ask(services, "LoadRegions", scene_graph_msgs.srv.LoadRegions.Request(text=KEPT))
    assert response.status.code == Status.OK
    return services


def topics_of(snapshot: Any, noun: str) -> dict[str, str]:
    """Return the topics of all sources, those of deformable geometries alone."""

    class Topics(dict):
        def __missing__(self, name: str) -> str:
            return f"/{name}/configurations"

    return Topics() if noun == "configurations" else {}


def ask(services: OfferedServices, name: str, request: Any) -> Any:
    """Return the response to a request, or the result of a goal."""
    if name == "PlanPath":
        goal = Goal(bytes(16), request, Time(), lambda goal, feedback: assert_finite(feedback))
        return services.plans._plan(goal).result
    if name in QUERIES:
        answers: list[Any] = []
        services.queries.answer_to(name)(request, answers.append)
        return answers[0]
    assert name in EDITS
    return services.edits.answer_to(name)(request, getattr(scene_graph_msgs.srv, name).Response())
