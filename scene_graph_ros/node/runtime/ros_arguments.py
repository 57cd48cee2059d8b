"""Faults of the arguments that ROS takes, in one sentence, before ROS sees them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, read_limited
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import SceneFileError, suggestion
from scene_graph_ros.node.runtime.parameter_sections import full_name, reaches, sections_of

__all__ = ["problem_of", "said_by_ros", "unreached"]

_LEVELS = ("debug", "info", "warn", "error", "fatal", "unset")
_FILE = "--params-file"


def problem_of(args: Sequence[str]) -> str:
    """Return the fault that keeps ROS from starting: a missing file, a wrong level; "" if none."""
    for path in _values(args, _FILE):
        try:
            read_limited(path, MAX_TEXT_BYTES)
        except OSError as error:
            return f"{_FILE} {quoted(path)} can't be read: {error.strerror}"
    for value in _values(args, "--log-level"):
        level = value.rpartition(":=")[2]
        if level.lower() not in _LEVELS:
            known = ", ".join(_LEVELS[:-1])
            return f"--log-level must be one of {known}, not {quoted(level)}" + suggestion(
                level.lower(), _LEVELS
            )
    return ""


def said_by_ros(error: Exception) -> str:
    """Return ROS's own words on wrong arguments, without places in its sources."""
    text = str(error).partition(", at /")[0]
    for prefix in ("failed to initialize rcl: ", "Failed to parse ROS arguments: "):
        text = text.removeprefix(prefix)
    return f"these arguments can't be used: {text}"


def unreached(args: Sequence[str], node: str) -> Iterator[str]:
    """Yield a sentence for each file of parameters of which none is for this node."""
    files = list(_values(args, _FILE))
    if not files:
        return
    from scene_graph_ros.scene_files.yaml_document import parse_yaml

    for path in files:
        try:
            data = parse_yaml(read_limited(path, MAX_TEXT_BYTES), path).data
        except (OSError, SceneFileError):
            continue  # ROS has read it, by rules of its own
        names = [full_name(section) for section, _ in sections_of(data)]
        if not any(reaches(section, node) for section, _ in sections_of(data)):
            others = ", ".join(names[:5]) or "nobody"
            yield (
                f"{_FILE} {quoted(path)} has no parameters for {node}, but for {others}: the node"
                " has its defaults"
            )


def _values(args: Sequence[str], option: str) -> Iterator[str]:
    """Yield the values of an option among the arguments of ROS."""
    is_ros = False
    for argument, value in zip(args, [*args[1:], ""], strict=True):
        if argument in ("--ros-args", "--"):
            is_ros = argument == "--ros-args"
        elif is_ros and argument == option:
            yield value
