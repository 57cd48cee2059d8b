"""The parts of the node and how they hang together: world, inputs, effects, services."""

from __future__ import annotations

import time
import traceback
from typing import Any, TYPE_CHECKING

from rclpy.parameter import Parameter

from msg_adapters.queries import NO_OPTIONS
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.node.clock_watch import ClockWatch
from scene_graph_ros.node.diagnostics import Monitor
from scene_graph_ros.node.diagnostics_topic import DiagnosticsTopic, Watched
from scene_graph_ros.node.effects.answer_thread import Found
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.recorder_on_demand import RecordingOnDemand
from scene_graph_ros.node.resolved_topics import ResolvedTopics
from scene_graph_ros.node.runtime.declare import NodeParameters
from scene_graph_ros.node.runtime.guarded import GuardedNode
from scene_graph_ros.node.runtime.kernel_supply import KernelSupply
from scene_graph_ros.node.runtime.loop import OwnThreadGroup, UpdateLoop
from scene_graph_ros.node.runtime.namesakes import Namesakes
from scene_graph_ros.node.runtime.precedence import Precedence
from scene_graph_ros.node.runtime.requests import RequestLoop
from scene_graph_ros.node.services.edit_answers import EditAnswers, EditHooks
from scene_graph_ros.node.services.plan_action import PlanAction, PlanHooks
from scene_graph_ros.node.services.queries import QueryScope
from scene_graph_ros.node.services.query_answers import QueryAnswers
from scene_graph_ros.node.services.replies import Replies
from scene_graph_ros.node.services.services import Services
from scene_graph_ros.node.services.waiting import Waiting
from scene_graph_ros.node.world.edits import Tools
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.regions_on_demand import RegionsOnDemand
from scene_graph_ros.node.world.scenes import loader_of, SceneLoader
from scene_graph_ros.node.world.subscriptions import Subscriptions
from scene_graph_ros.node.world.world import World, WorldSnapshot

if TYPE_CHECKING:
    from collections.abc import Callable

    from scene_graph_ros.node.recording.recorder import Recorder
    from scene_graph_ros.node.services.descriptions import Descriptions
    from scene_graph_ros.node.world.kept_regions import KeptRegions
    from scene_graph_ros.views.browser.channels import Channels
    from scene_graph_ros.views.moment import Trouble

__all__ = ["Server"]


class Server:
    """A geometry world on a node: `configure`, `activate`, `deactivate`, `clean_up`.

    Configured it answers services, active it also takes in poses and publishes.
    """

    def __init__(self, node: GuardedNode, scene_graph: SceneGraph | None = None) -> None:
        """Declare the parameters; raises ValueError for values that don't go together."""
        self.node = node
        self._parameters = NodeParameters(node)
        self._given_scene_graph = scene_graph
        self.world_frame: str = self.parameter("world_frame")
        self.group = OwnThreadGroup()
        self.recording = RecordingOnDemand(node, self.parameter)
        self.channels: Channels | None = None
        self._diagnostics = DiagnosticsTopic(node, self.parameter)
        self._monitor = Monitor()
        self._namesakes = Namesakes(node)
        self._precedence = Precedence()
        self._loop = UpdateLoop(
            node,
            self.group,
            self._update,
            topics=lambda: self._subscriptions.follow_scene(),  # noqa: PLW0108 - made later
            max_rate=lambda: self.parameter("max_update_rate"),
            min_rate=lambda: self.parameter("min_update_rate"),
            precedence=self._precedence,
            received=lambda: None if self.recorder is None else self._received,
        )
        self._topics = ResolvedTopics(node)
        self._is_configured = False
        self._is_active = False
        self._planned: PlannedPath | None = None
        node.add_post_set_parameters_callback(self._follow_parameters)

    @property
    def world(self) -> World:
        """The world; only there while configured."""
        return self._world

    @property
    def effects(self) -> Effects:
        """The effects; only there while configured."""
        return self._effects

    @property
    def recorder(self) -> Recorder | None:
        """The recorder, None where nothing is recorded."""
        return self.recording.recorder

    @property
    def troubles(self) -> tuple[Trouble, ...]:
        """Faults in the diagnostics that a browser was last shown."""
        return self._diagnostics.troubles

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter of the node."""
        return self._parameters[name]

    def is_running(self) -> bool:
        """Tell whether poses are taken in and the world is updated."""
        return self._is_active

    def pose_topics(self, snapshot: WorldSnapshot) -> dict[str, str]:
        """Return the absolute name of each source's pose topic, subscribed to yet or not."""
        return self._topics.of(snapshot, "poses")

    def publishers_changed(self) -> None:
        """Follow other publishers than before."""
        self._loop.topics_changed()

    def lack_of_kernels(self, group: str) -> str:
        """Return a sentence about a group's kernels that are not ready; "" where they are."""
        return self._kernels.lack(group)

    def request_update(self) -> None:
        """Ask for an update soon, also when no poses arrive."""
        if self._is_active:
            self._loop.request()

    def scene_changed(self) -> None:
        """Follow a change of the scene: subscriptions, effects."""
        self._loop.topics_changed()
        self._effects.switch_off(self._world.effects_off)
        self.request_update()

    def answer(self, name: str, snapshot: WorldSnapshot) -> Any | None:
        """Return an effect's answer about ``snapshot``, None where it is not there."""
        return self._effects.answer(name, snapshot)

    def newest_answer(self, name: str) -> Found | None:
        """Return the newest answer that came, of an effect whose answers may be late."""
        return self._effects.newest_answer(name)

    def newest_plan(self) -> PlannedPath | None:
        """Return the path that was found last, None before the first."""
        return self._planned

    def plan_found(self, path: PlannedPath) -> None:
        """Show a path, and look whether it holds, in place of the one before."""
        self._planned = path
        self._effects.record("plan", 0.0)
        if self._effects.running("plan") is None:
            self._effects.come_on(self._world.snapshot)
        self.request_update()

    def kept_regions(self) -> KeptRegions | None:
        """Return the regions that are kept, None before the first."""
        return self._regions.existing

    def _regions_changed(self, count: int) -> None:
        self._effects.keeps("regions", count)
        self.request_update()

    def contacts_published(self, snapshot: WorldSnapshot) -> None:
        """Take the time from the arrival of poses to their contacts."""
        if snapshot.arrival is not None:
            self._monitor.published(snapshot.sequence, snapshot.arrival, time.monotonic_ns())

    def configure(self) -> None:
        """Load the scene and offer the services."""
        loader = loader_of(self.parameter, message_type, EFFECT_NAMES)
        self.recording.begin(
            lambda: loader.text(self.parameter("scene")), self._given_scene_graph is not None
        )
        self.channels = None
        try:
            if self.parameter("browser"):
                from scene_graph_ros.node.effects.browser_channels import open_channels

                self.channels = open_channels(
                    self.node, self.request_update, lambda: self.world.snapshot
                )
            self._configure(loader)
        except BaseException:
            self.recording.end()
            raise

    def _received(self, topic: Any, data: bytes) -> None:
        if self.recorder is not None:
            self.recorder.received(topic, data, self._world)

    def _configure(self, loader: SceneLoader) -> None:
        world = World(
            self._given_scene_graph,
            world_frame=self.world_frame,
            check=self._topics.check,
            precedence=self._precedence,
        )
        world.set_accuracy(self.parameter("accuracy"))
        scene = self.parameter("scene")
        if scene:
            world.edit(lambda edit: loader.load(edit, scene))
        self._world = world
        self._planned = None
        self._regions = RegionsOnDemand(lambda: world.snapshot, self._regions_changed)
        self._descriptions: Descriptions | None = None
        self._kernels = KernelSupply(self.node.get_logger(), self._kernels_came)
        self._subscriptions = Subscriptions(
            self.node,
            world,
            self.group,
            self._loop.topics_changed,
            self._describe,
            self.parameter("max_points_per_cloud"),
            self.parameter("max_voxels_per_map"),
            self.lack_of_kernels,
            self._loop.request,
        )
        self._loader = loader
        self._effects = Effects(self, lack=self._kernels.lack)
        self._effects.switch_off(world.effects_off)
        self._services = self._offer_services(loader)
        self.begin_plan = self._services.plans.begin
        watched = Watched(
            world,
            self._subscriptions.all,
            self._effects,
            self._services,
            self._monitor,
            self._namesakes,
        )
        self._diagnostics.open(watched, self.group, self.channels)
        self._clock = ClockWatch(
            self.node,
            world,
            self._subscriptions,
            self._monitor,
            self.parameter,
            lambda: self.recorder,
            self.request_update,
        )
        self._is_configured = True

    def _offer_services(self, loader: SceneLoader) -> Services:
        """Hand each service the parts that it uses, and let them answer."""
        node, world, effects, parameter = self.node, self._world, self._effects, self.parameter
        text = loader.requested_text
        replies = Replies(world, node.get_logger())
        loop = RequestLoop(
            node,
            threads=parameter("service_threads"),
            most_waiting=lambda: parameter("max_waiting_requests"),
        )
        waiting = Waiting(world, self.is_running, post=loop.post, set_alarm=loop.set_alarm)
        queries = QueryAnswers(
            lambda: QueryScope(
                world.snapshot, NO_OPTIONS, parameter, self._topics.of, self._regions.made, text
            ),
            waiting,
            replies,
            parameter=parameter,
            lack_of_kernels=self.lack_of_kernels,
            record=effects.record,
        )
        edits = EditAnswers(
            world,
            Tools(loader.resolve, message_type, loader.load_request, text),
            replies,
            EditHooks(effects.prepare, self.scene_changed, lambda: self.recorder, self._topics.of),
            parameter=parameter,
            logger=node.get_logger(),
        )
        plans = PlanAction(
            node,
            world,
            loop,
            replies,
            PlanHooks(
                text,
                self.plan_found,
                lambda seconds: effects.record("planning", seconds),
                self.lack_of_kernels,
            ),
            parameter=parameter,
        )
        return Services(loop, waiting, replies, queries, edits, plans, effects.reports)

    def activate(self) -> None:
        """Take in poses and publish; where that fails, all is as before."""
        self._is_active = True
        try:
            self._begin()
        except BaseException:
            self.deactivate()
            raise

    def _begin(self) -> None:
        self._subscriptions.follow_scene()
        self._effects.open()
        snapshot = self._world.snapshot
        self._effects.update(snapshot)
        if self.parameter("browser") and self.parameter("browser_required"):
            self._effects.require("browser", "with browser_required false the node goes on")
        for report in self._effects.reports():
            if not report.is_on:
                self.node.get_logger().debug(f"effect {report.name} is off: {report.reason}")
        inspector = snapshot.inspector
        self.node.get_logger().info(
            f"running: {len(self._world.records)} sources, {inspector.num_frames() - 1} frames, "
            f"{inspector.num_geometries()} geometries"
        )
        self._loop.start()

    def deactivate(self) -> None:
        """Stop taking in poses and publishing; services still answer."""
        if self._is_active:
            self._is_active = False
            self._loop.stop()
            self._subscriptions.close()
            self._effects.close()
            self._services.end_waiting()
            if self.recorder is not None:
                self.recorder.stopped()

    def clean_up(self) -> None:
        """Forget the world and stop offering the services."""
        if self._is_configured:
            self._is_configured = False
            self._diagnostics.close()
            if self._descriptions is not None:
                self._descriptions.stop()
            self._clock.close()
            self._services.close()
            self._kernels.stop()
            self.recording.end()

    def stop(self) -> None:
        """End all activity, in any state."""
        self.deactivate()
        self.clean_up()

    def _kernels_came(self) -> None:
        self._effects.come_on(self._world.snapshot)
        self._loop.topics_changed()
        self.request_update()

    # What happens while it runs.

    def _describe(self, name: str, text: str, told: Callable[[str], None]) -> None:
        """Have a robot become as a text describes it; the thread for that comes with the first."""
        if self._descriptions is None:
            from scene_graph_ros.node.services.descriptions import Descriptions

            self._descriptions = Descriptions(
                self.node,
                self._world,
                self._loader,
                self._effects.prepare,
                lambda: self.recorder,
                self.scene_changed,
            )
        self._descriptions.describe(name, text, told)

    def _update(self) -> None:
        if not self._is_active:
            return
        try:
            self._subscriptions.look()
            limits = self._clock.limits()
            due = self._effects.due(self._world.snapshot)
            with self._world.lock:
                self._clock.forget_impossible_stamps(limits)
                moved, deformed, sensed, looked, first = self._subscriptions.collect(limits)
                snapshot = self._world.snapshot
                if moved or deformed or sensed:
                    snapshot = self._world.commit(moved, first, deformed, sensed)
                if self.recorder is not None:
                    self.recorder.updated(limits, snapshot, looked)
            self._effects.update(snapshot, due)
            self._monitor.updated(time.monotonic_ns())
        except Exception:  # noqa: BLE001 - the node survives its own fault, and says so
            self._monitor.errors += 1
            self.node.get_logger().error(
                f"an update failed:\n{traceback.format_exc()}", throttle_duration_sec=1.0
            )

    def _follow_parameters(self, parameters: list[Parameter]) -> None:
        if not self._is_configured:
            return
        for parameter in parameters:
            if parameter.name == "accuracy":
                with self._world.lock:
                    self._world.set_accuracy(parameter.value)
                    if self.recorder is not None:
                        self.recorder.accuracy_set(parameter.value)
            elif parameter.name == "diagnostics_rate":
                self._diagnostics.follow_rate(parameter.value)
        # Rates count from now on, not after the wait that the old ones meant.
        self.request_update()
