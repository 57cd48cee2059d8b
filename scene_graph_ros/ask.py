"""Ask a running node from a shell, without the `ros2` command: topics, queries, plans, parameters.

`python -m scene_graph_ros.ask --help` lists its questions.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
import importlib
import math
from pathlib import Path
import sys
from typing import Any

__all__ = ["main"]

_LONGEST = 12
"""Entries of an array that are printed."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer one question; return 0, 1 where there is no answer, 2 for a wrong call."""
    options = _parser().parse_args(arguments)
    from scene_graph_ros.client import World, WorldError

    try:
        with World(
            name=options.node, namespace=options.namespace, timeout=options.timeout
        ) as world:
            return int(options.run(world, options) or 0)
    except (WorldError, ValueError, OSError) as error:
        _say(f"error: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        return 130
    return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m scene_graph_ros.ask", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--node", default="scene_graph", help="its name (default: %(default)s)")
    parser.add_argument("--namespace", default="/", help="its namespace (default: %(default)s)")
    parser.add_argument(
        "--timeout", type=float, default=10.0, help="seconds to wait for an answer (%(default)s)"
    )
    commands = parser.add_subparsers(title="questions", required=True, metavar="QUESTION")

    def add(name: str, run: Any, text: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(run=run)
        return command

    add("nodes", _nodes, "the nodes that there are")
    add("topics", _topics, "the topics that there are, with their types")
    add("services", _services, "the services of the node, with their types")
    echo = add("echo", _echo, "print messages of a topic")
    echo.add_argument("topic", help="/a/topic, or one below the node's name, such as contacts")
    echo.add_argument("--count", type=int, default=1, help="how many (default: %(default)s)")
    add("scene", _scene, "the geometries of the scene, and where they are")
    add("contacts", _contacts, "what penetrates, the deepest first")
    near = add("distances", _distances, "pairs that are near, the nearest first")
    near.add_argument("--max", type=float, default=0.1, help="metres (default: %(default)s)")
    pair = add("distance", _distance, "how far two geometries are apart")
    pair.add_argument("A", help="source/frame/geometry, or the last part where it is unique")
    pair.add_argument("B")
    pose = add("pose", _pose, "where a frame or a geometry is in the world")
    pose.add_argument("name")
    plan = add("plan", _plan, "a path that is proven free, from where the robots are")
    plan.add_argument("goal", nargs="+", metavar="JOINT=POSITION", help="rad or m")
    plan.add_argument("--group", default="", help="of the SRDF: which joints may move")
    plan.add_argument("--padding", type=float, default=0.0, help="metres to be kept")
    plan.add_argument("--seconds", type=float, default=5.0, help="to look for it (%(default)s)")
    plan.add_argument("--execute", metavar="TOPIC", help="of a controller that takes trajectories")
    picture = add("picture", _picture, "what a camera of the scene sees, as a PNG file")
    picture.add_argument("camera")
    picture.add_argument("-o", "--output", type=Path, help="(default: <camera>.png)")
    param = add("param", _param, "list, get or set the node's parameters")
    param.add_argument("name", nargs="?", help="without it: all, with their values")
    param.add_argument("value", nargs="?", help="the new value, as YAML")
    return parser


def _say(text: object, file: Any = None) -> None:
    print(text, file=file, flush=True)


def _settled(world: Any) -> Any:
    """Return the node of ours, once the others are known to it."""
    world.wait_until_ready()
    connection = world.connection

    def is_listed() -> bool:
        found = connection.node.get_node_names_and_namespaces()
        return any(f"{space.rstrip('/')}/{name}" == connection.target for name, space in found)

    connection.wait(is_listed, f"{connection.target} in the list of nodes")
    return connection.node


def _nodes(world: Any, options: Any) -> None:
    own = world.connection.node.get_name()
    for name, space in sorted(_settled(world).get_node_names_and_namespaces()):
        if name != own:
            _say(f"{space.rstrip('/')}/{name}")


def _topics(world: Any, options: Any) -> None:
    for name, types in sorted(_settled(world).get_topic_names_and_types()):
        _say(f"{name}  {', '.join(types)}")


def _services(world: Any, options: Any) -> None:
    start = f"{world.connection.target}/"
    for name, types in sorted(_settled(world).get_service_names_and_types()):
        if name.startswith(start):
            _say(f"{name}  {', '.join(types)}")


def _echo(world: Any, options: Any) -> int:
    connection = world.connection
    name = options.topic
    topic = name if name.startswith("/") else f"{connection.target}/{name}"

    def found() -> Any:
        return dict(connection.node.get_topic_names_and_types()).get(topic)

    kinds = connection.wait(found, f"the topic {topic}")
    package, _, kind = kinds[0].split("/")
    message_type = getattr(importlib.import_module(f"{package}.msg"), kind)
    for message in _messages(connection, message_type, topic, options.count):
        _say("\n".join(_lines(message)))
        _say("---")
    return 0


def _messages(connection: Any, kind: Any, topic: str, count: int) -> Iterator[Any]:
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    offers = [e.qos_profile for e in connection.node.get_publishers_info_by_topic(topic)]
    latched = offers and all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
    reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    qos = QoSProfile(
        depth=10,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
    )
    got: list[Any] = []

    def take(message: Any) -> None:
        got.append(message)
        connection.notify()

    subscription = connection.node.create_subscription(kind, topic, take, qos)
    try:
        for number in range(count):
            yield connection.wait(
                lambda number=number: got[number : number + 1], f"a message on {topic}"
            )[0]
    finally:
        connection.node.destroy_subscription(subscription)


def _lines(message: Any, indent: str = "") -> Iterator[str]:
    """Print a message as YAML, with long arrays cut."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            yield f"{indent}{name}:"
            yield from _lines(value, f"{indent}  ")
        elif isinstance(value, (str, bool, int, float)):
            yield f"{indent}{name}: {value!r}"
        elif len(value) and hasattr(value[0], "get_fields_and_field_types"):
            yield f"{indent}{name}:"
            for each in value[:_LONGEST]:
                first, *others = _lines(each, f"{indent}  ")
                yield f"{indent}- {first.strip()}"
                yield from others
            if len(value) > _LONGEST:
                yield f"{indent}# ... {len(value)} in all"
        else:
            shown = ", ".join(map(repr, list(value[:_LONGEST])))
            more = f", ... {len(value)} in all" if len(value) > _LONGEST else ""
            yield f"{indent}{name}: [{shown}{more}]"


def _scene(world: Any, options: Any) -> None:
    table = world.geometries()
    for row in table:
        _say(f"{row.source}/{row.frame}/{row.name}  at {row.x:.6g} {row.y:.6g} {row.z:.6g} m")


def _contacts(world: Any, options: Any) -> None:
    table = world.contacts()
    for row in table:
        _say(f"{row.A} and {row.B}  {1e3 * row.depth:.6g} mm deep")
    if not len(table):
        _say("nothing touches")


def _distances(world: Any, options: Any) -> None:
    table = world.distances(options.max)
    for row in table:
        _say(f"{row.A} and {row.B}  {1e3 * row.distance:.6g} mm")
    if not len(table):
        _say(f"no pair is nearer than {options.max:g} m")


def _distance(world: Any, options: Any) -> None:
    found = world.distance(options.A, options.B)
    _say(f"{found.A} and {found.B}  {1e3 * found.distance:.6g} mm")


def _pose(world: Any, options: Any) -> None:
    for row in world.pose(options.name).tolist():
        _say(" ".join(f"{value:12.6f}" for value in row))


def _plan(world: Any, options: Any) -> int:
    goal = {}
    for text in options.goal:
        name, sign, value = text.rpartition("=")
        try:
            goal[name] = float(value)
        except ValueError:
            sign = ""
        if not sign or not math.isfinite(goal.get(name, math.nan)):
            raise ValueError(f"a goal is JOINT=POSITION, not {text!r}")
    found = world.plan(goal, group=options.group, padding=options.padding, timeout=options.seconds)
    if not found.is_success:
        _say(f"no path: {found.reason}")
        return 1
    _say(
        f"a path of {len(found.path)} configurations, found in {found.seconds:.3g} s; its"
        f" trajectory takes {found.duration:.3g} s and keeps {1e3 * found.clearance:.4g} mm"
    )
    for row in found.path.tolist():
        _say("  ".join(f"{n}={v:.4f}" for n, v in zip(found.names, row, strict=True)))
    if options.execute:
        execution = world.execute(found, options.execute)
        execution.wait()
        _say("the robot has arrived")
    return 0


def _picture(world: Any, options: Any) -> None:
    # A file format alone, of a package without kernels.
    from scene_graph_ros.views.png import png

    output = options.output or Path(f"{options.camera}.png")
    output.write_bytes(png(world.picture(options.camera)))
    _say(f"wrote {output}")


def _param(world: Any, options: Any) -> int:
    from scene_graph_ros.client.parameters import get_parameters, set_parameter

    if options.value is not None:
        set_parameter(world.connection, options.name, options.value)
    for name, value in get_parameters(world.connection, options.name).items():
        _say(f"{name}: {value}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
