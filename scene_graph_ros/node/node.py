"""The node: a lifecycle node around the server, which starts by itself unless told otherwise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.node.runtime.guarded import GuardedNode
from scene_graph_ros.node.runtime.kernel_watch import KernelWatch
from scene_graph_ros.node.runtime.names import NODE_NAME
from scene_graph_ros.node.server import Server

__all__ = ["SceneGraphNode"]


class SceneGraphNode(GuardedNode):
    """A geometry world as a ROS node.

    By default it configures and activates itself, and offers the lifecycle services, too; with
    the parameter ``autostart`` false it waits for a lifecycle manager.
    Inactive it answers services; active it also takes in poses and publishes.

    To embed it: pass ``context``, ``parameter_overrides`` or other options of ``rclpy.node.Node``
    and add it to any executor. ``scene_graph`` gives it a model to start from.
    """

    def __init__(
        self, node_name: str = NODE_NAME, *, scene_graph: SceneGraph | None = None, **options: Any
    ) -> None:
        """Start; raises ValueError for wrong parameters, SceneFileError for a wrong scene."""
        super().__init__(node_name, **options)
        self.server = Server(self, scene_graph)
        self._kernels = KernelWatch(self.get_logger())
        self._failure: Exception | None = None
        if self.server.parameter("autostart"):
            self._start_by_itself()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.get_fully_qualified_name()!r})"

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Load the scene and offer the services."""
        return self._transition("configure", self.server.configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take in poses and publish."""
        return self._transition("activate", self.server.activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop taking in poses and publishing; services still answer."""
        return self._transition("deactivate", self.server.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget the world and stop offering the services."""
        return self._transition("clean up", self.server.clean_up)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop everything."""
        return self._transition("shut down", self.server.stop)

    def destroy_node(self) -> None:
        """Stop everything and destroy the node."""
        self.server.stop()
        self._kernels.stop()
        super().destroy_node()

    def _start_by_itself(self) -> None:
        for trigger in (self.trigger_configure, self.trigger_activate):
            if trigger() != TransitionCallbackReturn.SUCCESS:
                self.destroy_node()
                assert self._failure is not None
                raise self._failure

    def _transition(self, what: str, action: Callable[[], None]) -> TransitionCallbackReturn:
        try:
            action()
        except Exception as error:  # noqa: BLE001 - told to the lifecycle manager and the log
            self._failure = error
            self.get_logger().error(f"can't {what}: {error}")
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS
