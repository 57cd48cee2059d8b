"""The topic /diagnostics: made at its rate, while somebody reads it."""

from __future__ import annotations

from collections.abc import Callable
import threading
import time
from typing import Any, NamedTuple, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.serialization import serialize_message

from msg_adapters.definitions import kind_of
from scene_graph_ros.geometry.model.mesh_notes import mesh_notes
from scene_graph_ros.node.diagnostics import Diagnostics, Monitor, troubles_of
from scene_graph_ros.node.diagnostics_of_parts import parts_of
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.runtime.guarded import GuardedNode
from scene_graph_ros.node.runtime.names import DIAGNOSTICS
from scene_graph_ros.node.runtime.namesakes import Namesakes
from scene_graph_ros.node.runtime.qos import diagnostics_qos, overridable
from scene_graph_ros.node.services.services import Services
from scene_graph_ros.node.world.handles import Claim
from scene_graph_ros.node.world.source_channel import Inputs
from scene_graph_ros.node.world.world import World

if TYPE_CHECKING:
    from scene_graph_ros.views.browser.channels import Channel, Channels
    from scene_graph_ros.views.moment import Trouble

__all__ = ["DiagnosticsTopic", "Watched"]


class Watched(NamedTuple):
    """The objects that the diagnostics report on."""

    world: World
    inputs: list[Inputs[Any]]
    effects: Effects
    services: Services
    monitor: Monitor
    namesakes: Namesakes


class DiagnosticsTopic:
    """Publishes faults and figures of the node; advertised between `open` and `close`."""

    def __init__(self, node: GuardedNode, parameter: Callable[[str], Any]) -> None:
        """Make the timer, which is never destroyed while an executor may be waiting for it."""
        self._node = node
        self._parameter = parameter
        self.troubles: tuple[Trouble, ...] = ()
        self._meshes = (-1, "")
        self._lock = threading.Lock()
        self._is_open = False
        self._timer = node.create_timer(
            1.0 / parameter("diagnostics_rate"),
            node.survives("publishing diagnostics", self._publish),
            callback_group=MutuallyExclusiveCallbackGroup(),
            clock=Clock(clock_type=ClockType.STEADY_TIME),
            autostart=False,
        )

    def open(self, watched: Watched, group: Any, channels: Channels | None) -> None:
        """Advertise the topic, to clients of the view in a browser, too."""
        self._watched = watched
        self._diagnostics = Diagnostics(self._node.get_fully_qualified_name().lstrip("/"))
        self._publisher = self._node.create_publisher(
            DiagnosticArray,
            DIAGNOSTICS,
            diagnostics_qos(),
            callback_group=group,
            qos_overriding_options=overridable(),
        )
        self._channel: Channel | None = None
        if channels is not None:
            self._channel = channels.channel(self._publisher.topic_name, kind_of(DiagnosticArray))
        self._is_open = True
        self.follow_rate(self._parameter("diagnostics_rate"))

    def follow_rate(self, rate: float) -> None:
        """Publish so often (Hz) from now on."""
        self._timer.timer_period_ns = int(1e9 / rate)
        # Else the executor would wait for what was due before.
        self._timer.reset()
        self._node.wake_executor()

    def close(self) -> None:
        """Stop being advertised."""
        self._timer.cancel()
        with self._lock:
            self._is_open = False
            self._node.destroy_publisher(self._publisher)

    def _publish(self) -> None:
        with self._lock:
            # A timer may have been due when it was cancelled.
            if not self._is_open:
                return
            channel = self._channel
            is_heard = channel is not None and channel.is_heard()
            view = self._watched.effects.running("browser")
            is_seen = view is not None and view.has_work()
            has_readers = self._publisher.get_subscription_count() > 0
            if not (is_heard or is_seen or has_readers):
                return
            message = self._message()
            data = serialize_message(message)
            self._publisher.publish(data)
            if channel is not None:
                channel.write(data)
            if is_seen:
                self.troubles = troubles_of(message)

    def _notes_on_meshes(self, snapshot: Any) -> str:
        """Return the number of meshes that are no solids, and a reason; found once per scene."""
        version, text = self._meshes
        if version != snapshot.scene_version:
            notes = mesh_notes(snapshot.inspector)
            text = "0" if not notes else f"{len(notes)}: {notes[0]}"
            self._meshes = snapshot.scene_version, text
        return text

    def _message(self) -> DiagnosticArray:
        watched, diagnostics = self._watched, self._diagnostics
        now = time.monotonic_ns()
        max_age = self._parameter("max_pose_age")
        moment = self._node.get_clock().now().nanoseconds
        sources = [
            diagnostics.source(
                name,
                channel.topic,
                channel.intake.statistics,
                now,
                max_age,
                noun=inputs.noun,
                parts=parts_of(channel, now, moment, max_age),
            )
            for inputs in watched.inputs
            for name, channel in inputs.channels.open.items()
        ]
        sources += [
            diagnostics.missing(name, reason, noun=inputs.noun)
            for inputs in watched.inputs
            for name, reason in inputs.channels.failures.items()
        ]
        snapshot = watched.world.snapshot
        accuracy = snapshot.query.accuracy
        world = diagnostics.world(
            watched.monitor,
            now,
            scene_version=snapshot.scene_version,
            warning=watched.namesakes.problem,
            values={
                "accuracy": accuracy.value,
                "accuracy: largest error (of the larger shape)": accuracy.bound,
                "requests": watched.services.counts.requests,
                "requests refused": watched.services.counts.refused,
                "clock messages refused": self._node.clocks_refused,
                "nodes of the same name": watched.namesakes.count,
                "meshes that are no solids": self._notes_on_meshes(snapshot),
                **_claims(watched.world),
            },
        )
        return diagnostics.message(
            stamp=moment,
            world=world,
            sources=sources,
            effects=watched.effects.reports(),
        )


def _claims(world: World) -> dict[str, str]:
    """Return the sources that may be claimed, and those that were, where there are such."""
    handles = world.handles
    words = {Claim.OPEN: "sources that the first may claim", Claim.TAKEN: "sources claimed"}
    named = {
        text: ", ".join(name for name, handle in handles.items() if handle.claim is claim)
        for claim, text in words.items()
    }
    return {text: names for text, names in named.items() if names}
