"""What pages ask of the command `ros2`, which the wheels lack: a call, a goal, a message by topic.

    ros2 service call NAME TYPE [REQUEST]
    ros2 action send_goal [--feedback] NAME TYPE GOAL
    ros2 topic pub NAME TYPE MESSAGE [--rate R]

Fields are YAML, as `ros2` reads them. The exit code is 1 where the answer's status is not OK, or a
plan has failed.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from typing import Any

import rclpy
from rclpy.action import ActionClient
import yaml

DEADLINE = 60.0
_HEARD = 10
"""Messages that somebody has subscribed to, before the next command begins."""


def _type(name: str) -> Any:
    """Return the class of "package/kind/Name"."""
    package, kind, cls = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), cls)


def _class_of(slot_type: Any) -> Any:
    return _type("/".join(slot_type.namespaced_name()))


def fill(message: Any, fields: dict[str, Any]) -> Any:
    """Set fields of a message, also nested ones, and return it."""
    types = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in fields.items():
        if value == "now":
            continue  # a stamp, set when the message is published
        if name not in types:
            raise SystemExit(f"{type(message).__name__} has no field {name!r}: {[*types]}")
        of_items = getattr(types[name], "value_type", None)
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif isinstance(value, list) and hasattr(of_items, "namespaced_name"):
            setattr(message, name, [fill(_class_of(of_items)(), item) for item in value])
        else:
            present = getattr(message, name)
            is_real = isinstance(present, float) and isinstance(value, int)
            setattr(message, name, float(value) if is_real else value)
    return message


def _call(node: Any, arguments: argparse.Namespace, fields: dict[str, Any]) -> Any:
    kind = _type(arguments.type)
    client = node.create_client(kind, arguments.name)
    if not client.wait_for_service(DEADLINE):
        raise SystemExit(f"there is no service {arguments.name}")
    return _wait(node, client.call_async(fill(kind.Request(), fields)))


def _send_goal(node: Any, arguments: argparse.Namespace, fields: dict[str, Any]) -> Any:
    kind = _type(arguments.type)
    client = ActionClient(node, kind, arguments.name)
    if not client.wait_for_server(DEADLINE):
        raise SystemExit(f"there is no action {arguments.name}")
    handle = _wait(node, client.send_goal_async(fill(kind.Goal(), fields)))
    result = _wait(node, handle.get_result_async()).result
    client.destroy()
    return result


def _publish(node: Any, arguments: argparse.Namespace, fields: dict[str, Any]) -> None:
    message = fill(_type(arguments.type)(), fields)
    publisher = node.create_publisher(type(message), arguments.name, 10)

    heard = 0

    def publish() -> None:
        nonlocal heard
        heard += publisher.get_subscription_count() > 0
        if heard == _HEARD:  # until then a reader is still typing the next command
            print(f"publishing #{heard}", flush=True)
        if hasattr(message, "header"):  # "stamp: now", as the command has it
            message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    publish()
    node.create_timer(1.0 / arguments.rate, publish)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        raise SystemExit(0) from None


def _wait(node: Any, future: Any) -> Any:
    rclpy.spin_until_future_complete(node, future, timeout_sec=DEADLINE)
    if not future.done():
        raise SystemExit("no answer in time")
    return future.result()


_VERBS = {
    ("service", "call"): _call,
    ("action", "send_goal"): _send_goal,
    ("topic", "pub"): _publish,
}


def main() -> int:
    """Do what the command line says."""
    parser = argparse.ArgumentParser()
    for name in ("thing", "verb", "name", "type"):
        parser.add_argument(name)
    parser.add_argument("fields", nargs="?", default="{}")
    parser.add_argument("--feedback", action="store_true")
    parser.add_argument("--rate", type=float, default=1.0)
    arguments = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("reader")
    verb = _VERBS[arguments.thing, arguments.verb]
    answer = verb(node, arguments, yaml.safe_load(arguments.fields) or {})
    print(answer)
    status = getattr(answer, "status", None)
    return int(bool(getattr(status, "code", 0) or getattr(answer, "failure", 0)))


if __name__ == "__main__":
    sys.exit(main())
