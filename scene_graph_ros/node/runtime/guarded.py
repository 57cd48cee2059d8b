"""A lifecycle node of which no message can end the executor that spins it.

rclpy raises a callback's error out of the executor, and some requests to the services that it
offers for every node make its own callbacks raise. So each of them is answered here, in any
executor: a request that can't be served is refused with the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import functools
import traceback
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from msg_adapters.stamps import stamp_problem
from scene_graph_ros.node.runtime.late_responses import LateResponses

__all__ = ["GuardedNode"]

_LAST_TYPE = ParameterType.PARAMETER_STRING_ARRAY


class GuardedNode(LifecycleNode):
    """A lifecycle node whose own services answer every request, and which no clock upsets."""

    def __init__(self, node_name: str, **options: Any) -> None:
        """Take the options of ``rclpy.node.Node``."""
        self.clocks_refused = 0
        """Messages on /clock that said a time which can't be."""
        super().__init__(node_name, **options)
        self._late_responses = LateResponses(
            functools.partial(self.get_logger().warning, throttle_duration_sec=1.0)
        )
        ours = {
            SetParameters: self._set_each,
            SetParametersAtomically: self._set_all,
        }
        for service in self.services:
            answer = ours.get(service.srv_type, service.callback)
            if service.srv_type is ChangeState:
                answer = functools.partial(self._change_state, answer)
            service.callback = self._answered(service, answer)
            service.send_response = self._sent(service.service_name, service.send_response)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[..., Any], *args: Any, **options: Any
    ) -> Any:
        """Subscribe; of clocks only valid times are handed on."""
        if msg_type is Clock:
            callback = self._possible_clocks(callback)
        return super().create_subscription(msg_type, topic, callback, *args, **options)

    def destroy_node(self) -> None:
        """Destroy the node; responses whose client is not known yet are forgotten."""
        self._late_responses.close()
        super().destroy_node()
        # rclpy leaves it to the collector: until then its services seem to be there to everybody,
        # and with them the node.
        self._state_machine.destroy_when_not_in_use()

    def wake_executor(self) -> None:
        """Let the executor look again at the objects that it waits for, and for how long."""
        if self.executor is not None:
            self.executor.wake()

    def survives(self, what: str, callback: Callable[[], None]) -> Callable[[], None]:
        """Return a callback that logs the errors of ``callback`` under this name."""

        def guarded() -> None:
            try:
                callback()
            except Exception:  # noqa: BLE001 - no callback may end the executor
                self._say_failure(what)

        return guarded

    def _say_failure(self, what: str) -> None:
        self.get_logger().error(
            f"{what} failed:\n{traceback.format_exc()}", throttle_duration_sec=1.0
        )

    def _answered(self, service: Any, answer: Callable[[Any, Any], Any]) -> Callable[..., Any]:
        """Return a callback that answers each request of a service; a failure has no effect."""

        def guarded(request: Any, response: Any) -> Any:
            try:
                return answer(request, response)
            except Exception:  # noqa: BLE001 - every request is answered
                self._say_failure(service.service_name)
                return service.srv_type.Response()

        return guarded

    def _sent(self, name: str, send: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
        """Return a function that sends responses, also to clients that are not discovered yet."""
        late = self._late_responses
        return lambda response, header: late.send(name, functools.partial(send, response, header))

    def _change_state(self, change: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        """Refuse a transition that the state does not allow; rclpy raises for it."""
        machine, wanted = self._state_machine, request.transition
        allowed = {number: label for number, label, *_ in machine.available_transitions}
        # As rclpy has it, a label counts before a number.
        if wanted.label in allowed.values() or (not wanted.label and wanted.id in allowed):
            return change(request, response)
        name = repr(wanted.label[:100]) if wanted.label else wanted.id
        possible = ", ".join(f"{number} ({label})" for number, label in sorted(allowed.items()))
        self.get_logger().warning(
            f"transition {name} is refused: state '{machine.current_state[1]}' allows "
            f"{possible or 'none'}"
        )
        response.success = False
        return response

    def _set_each(self, request: Any, response: Any) -> Any:
        response.results = [self._set([message]) for message in request.parameters]
        return response

    def _set_all(self, request: Any, response: Any) -> Any:
        response.result = self._set(request.parameters)
        return response

    def _set(self, messages: Sequence[Any]) -> Any:
        """Set all parameters of some messages or none."""
        for message in messages:
            if message.value.type > _LAST_TYPE:
                return _refused(
                    f"{message.name[:100]!r}: there is no parameter type {message.value.type}, "
                    f"only 0 to {_LAST_TYPE}"
                )
        try:
            wanted = [Parameter.from_parameter_msg(message) for message in messages]
            return self.set_parameters_atomically(wanted)
        except ParameterNotDeclaredException:
            unknown = [m.name[:100] for m in messages if not self.has_parameter(m.name)]
            return _refused(f"parameters that are not declared: {unknown}")
        except Exception as error:  # noqa: BLE001 - every request is answered, with the reason
            self._say_failure("setting parameters")
            return _refused(str(error))

    def _possible_clocks(self, take: Callable[[Any], None]) -> Callable[[Any], None]:
        def guarded(message: Any) -> None:
            problem = stamp_problem(message.clock)
            if not problem and message.clock.sec < 0:
                problem = f"sec is {message.clock.sec}, before time began"
            if not problem:
                take(message)
                return
            self.clocks_refused += 1
            self.get_logger().warning(
                f"a message on /clock is ignored: {problem} (counted, warned about once)",
                once=True,
            )

        return guarded


def _refused(reason: str) -> Any:
    return SetParametersResult(successful=False, reason=reason)
