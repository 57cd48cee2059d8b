"""Calls of the core with arguments of every kind: an error that quotes them, and no change."""

from __future__ import annotations

import enum
import inspect
import random
from types import SimpleNamespace
from typing import Any

from fuzzing import fuzz, Target
import numpy as np
import pytest

from scene_graph_ros import geometry as core
from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    ProximityProperties,
    Role,
    RoleAssign,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.meshes.surface_mesh import read_obj_to_surface_mesh
from scene_graph_ros.geometry.query.what_if import ask_what_if

WRONG = {
    "none": lambda: None,
    "true": lambda: True,
    "number": lambda: 3,
    "negative": lambda: -1.5,
    "huge": lambda: 10**400,
    "nan": lambda: float("nan"),
    "infinity": lambda: float("inf"),
    "complex": lambda: 1j,
    "text": lambda: "text",
    "blank": lambda: " ",
    "long text": lambda: "x" * 5000,
    "bytes": lambda: b"bytes",
    "list": lambda: [1, 2],
    "nested": lambda: [[1], [2, 3]],
    "dict": lambda: {"a": 1},
    "tuple": lambda: (),
    "set": lambda: {1},
    "function": lambda: len,
    "class": lambda: Sphere,
    "object": object,
    "array": lambda: np.arange(3.0),
    "array of nan": lambda: np.full((4, 4), np.nan),
    "array of objects": lambda: np.array([None, "a"], dtype=object),
    "array of text": lambda: np.array(["a", "b"]),
    "large array": lambda: np.zeros((1000, 4, 4)),
    "numpy number": lambda: np.float32(1.5),
    "generator": lambda: (i for i in (1, 2)),
}
"""What most arguments are not."""


def build() -> SimpleNamespace:
    """Return a scene with something of everything."""
    made = SimpleNamespace(graph=SceneGraph())
    graph = made.graph
    made.source = graph.register_source("s")
    made.frame = graph.register_frame(made.source, GeometryFrame("f"))
    made.other = graph.register_frame(made.source, GeometryFrame("g"), parent=made.frame)
    made.instance = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
    made.instance.set_proximity_properties(ProximityProperties())
    made.ball = graph.register_geometry(made.source, made.frame, made.instance)
    lamp = GeometryInstance(np.eye(4), core.Box(1.0, 1.0, 1.0), "lamp")
    lamp.set_proximity_properties(ProximityProperties())
    made.lamp = graph.register_geometry(made.source, made.other, lamp)
    soft = GeometryInstance(np.eye(4), core.Box(1.0, 1.0, 1.0), "soft")
    world = graph.world_frame_id()
    made.soft = graph.register_deformable_geometry(made.source, world, soft, 1.0)
    made.context = graph.create_default_context()
    made.query = graph.query_object(made.context)
    made.inspector = graph.model_inspector()
    made.manager = graph.collision_filter_manager()
    made.properties = ProximityProperties()
    made.properties.add_property("a", "b", 1.0)
    made.set = GeometrySet(made.frame)
    made.declaration = CollisionFilterDeclaration().exclude_within(made.set)
    made.filter = made.manager.apply_transient(made.declaration)
    return made


RIGHT: dict[str, list[Any]] = {
    "source_id": [lambda s: s.source],
    "frame_id": [lambda s: s.frame, lambda s: s.graph.world_frame_id()],
    "geometry_id": [lambda s: s.ball, lambda s: s.soft, lambda s: s.lamp],
    "id_A": [lambda s: s.ball],
    "id_B": [lambda s: s.lamp],
    "any_id": [lambda s: s.source, lambda s: s.frame, lambda s: s.ball],
    "target": [lambda s: s.frame, lambda s: s.ball],
    "parent": [lambda s: s.frame, lambda s: s.ball],
    "context": [lambda s: s.context, lambda s: None],
    "frame": [lambda s: GeometryFrame("new")],
    "geometry": [lambda s: GeometryInstance(np.eye(4), Sphere(0.2), "new")],
    "properties": [lambda s: ProximityProperties(), lambda s: core.IllustrationProperties()],
    "assign": [lambda s: RoleAssign.NEW, lambda s: RoleAssign.REPLACE],
    "role": [lambda s: Role.PROXIMITY, lambda s: Role.UNASSIGNED],
    "shape": [lambda s: Sphere(0.3), lambda s: core.HalfSpace()],
    "geometry_set": [lambda s: s.set],
    "set_A": [lambda s: s.set],
    "set_B": [lambda s: GeometrySet(s.lamp)],
    "declaration": [lambda s: s.declaration],
    "filter_id": [lambda s: s.filter],
    "name": [lambda s: "b", lambda s: "new"],
    "group_name": [lambda s: "a", lambda s: "new"],
    "X_PF": [lambda s: np.eye(4)],
    "X_PG": [lambda s: np.eye(4)],
    "X_FG": [lambda s: np.eye(4), lambda s: None],
    "poses": [lambda s: {s.frame: np.eye(4)}],
    "configurations": [lambda s: {}, lambda s: [{s.frame: np.eye(4)}]],
    "p_WQ": [lambda s: [0.0, 0.0, 0.0]],
    "p_WQs": [lambda s: np.zeros((3, 3))],
    "query": [lambda s: s.query],
    "question": [lambda s: lambda query: 1],
    "threads": [lambda s: 1],
    "max_distance": [lambda s: 1.0],
    "threshold": [lambda s: 1.0],
    "derivatives": [lambda s: False],
    "certificate": [lambda s: False],
    "accuracy": [lambda s: None, lambda s: "quick"],
    "engine": [lambda s: None, lambda s: "native"],
    "resolution_hint": [lambda s: 0.5, lambda s: None],
    "reference_mesh": [lambda s: None],
    "vertices": [lambda s: np.eye(4, 3)],
    "faces": [lambda s: np.array([[0, 1, 2], [0, 2, 3]])],
    "before": [lambda s: s.inspector],
    "radius": [lambda s: 0.1],
    "length": [lambda s: 0.1],
    "frame_name": [lambda s: "new"],
    "frame_group_id": [lambda s: 3],
}
"""What arguments are, by their names."""

# Asking for these needs kernels of surfaces, which take minutes to compile where there are none.
LATE = {
    "compute_contact_surfaces",
    "compute_contact_surfaces_with_fallback",
    "compute_deformable_contact",
}
INTERNAL = {
    *("Context", "provide_queries", "share", "change", "change_filters", "resolve_set"),
    "all_or_nothing",
}
"""Not called by users: contexts come from create_default_context. What a function raises that is
called to make changes is the caller's own."""


def functions() -> dict[str, Any]:
    """Return all public functions and classes by their names."""
    found: dict[str, Any] = {"ask_what_if": ask_what_if, "read_obj": read_obj_to_surface_mesh}
    for name in core.__all__:
        thing = getattr(core, name)
        is_class = inspect.isclass(thing) and not issubclass(thing, enum.Enum)
        if inspect.isfunction(thing) or (is_class and name not in INTERNAL):
            found[name] = thing
    return found


FUNCTIONS = functions()


def methods(scene: SimpleNamespace) -> list[str]:
    """Return the names of all public methods, each behind that of what has it."""
    found = []
    for holder in ("graph", "context", "query", "inspector", "manager", "properties", "instance"):
        for name, _ in inspect.getmembers(type(getattr(scene, holder)), callable):
            if not name.startswith("_") and name not in LATE | INTERNAL:
                found.append(f"{holder}.{name}")
    return [*found, "declaration.exclude_within", "declaration.allow_between"]


def named(scene: SimpleNamespace, name: str) -> Any:
    """Return the function, class or method of this name."""
    holder, _, method = name.rpartition(".")
    return getattr(getattr(scene, holder), method) if holder else FUNCTIONS[name]


def parameters(function: Any) -> dict[str, inspect.Parameter]:
    """Return what a function takes by name."""
    try:
        known = inspect.signature(function).parameters
    except ValueError:  # an enumeration's, or one in C
        return {}
    return {
        name: parameter
        for name, parameter in known.items()
        if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
    }


def _names() -> dict[str, list[str]]:
    scene = build()
    return {name: list(parameters(named(scene, name))) for name in [*FUNCTIONS, *methods(scene)]}


NAMES = _names()
"""Of each, what it takes."""


def make(rng: random.Random) -> list[Any]:
    """Return calls: a name, and for each argument which of the right or wrong values it is."""
    steps = []
    for _ in range(rng.choice([1, 2, 4])):
        name = rng.choice(list(NAMES))
        wrong = rng.choice([0, 1, 1, 2])
        arguments = {}
        chosen = rng.sample(NAMES[name], min(wrong, len(NAMES[name])))
        for parameter in NAMES[name]:
            if parameter in chosen:
                arguments[parameter] = rng.choice(list(WRONG))
            elif parameter in RIGHT:
                arguments[parameter] = rng.randrange(len(RIGHT[parameter]))
        steps.append((name, arguments))
    return steps


def run(steps: list[Any]) -> None:
    """Call, and look at what is raised and at what is left of the scene."""
    scene = build()
    for name, chosen in steps:
        call(scene, name, chosen)


def call(scene: SimpleNamespace, name: str, chosen: dict[str, Any]) -> None:
    """Call one of them; where it raises, the scene is as before."""
    function = named(scene, name)
    arguments = {}
    for parameter, description in parameters(function).items():
        which = chosen.get(parameter)
        if isinstance(which, str):
            arguments[parameter] = WRONG[which]()
        elif which is not None:
            arguments[parameter] = RIGHT[parameter][which](scene)
        elif description.default is inspect.Parameter.empty:
            arguments[parameter] = 0.1
    before = state(scene)
    problem = result = None
    try:
        result = function(**arguments)
    except Exception as error:  # noqa: BLE001 - it is looked at next
        problem = error
    if problem is not None:
        assert_documented(problem, name, arguments)
        assert state(scene) == before, f"{name} changed something, and raised {problem!r}"
        return
    columns = getattr(result, "columns", {})
    for column in columns if isinstance(columns, dict) else dict(columns):
        values = np.asarray(columns[column])
        assert values.dtype.kind != "f" or not np.isnan(values).any(), (name, column)


def assert_documented(error: Exception, name: str, arguments: dict[str, Any]) -> None:
    """Fail unless an error is one of ours, or a plain one that names an argument or its value."""
    text = str(error).lower()
    label = f"{name}{tuple(arguments)}: {type(error).__name__}: {error}"[:1000]
    assert isinstance(error, (SceneGraphError, TypeError, ValueError)), label
    assert text, label
    words = [word for n in arguments for word in (n.lower(), n.lower().replace("_", " "))]
    words += ["rgba", *(part for n in arguments for part in n.lower().split("_") if len(part) > 2)]
    for value in arguments.values():
        inner = list(value)[:3] if isinstance(value, (list, tuple, dict, set, np.ndarray)) else []
        words += [_quote(part)[:12].lower() for part in (value, *inner)]
    if "question" in arguments:
        words.append("queryobject")  # what a question itself raises is about what it is given
    assert any(word in text for word in words if word), label


def _quote(value: Any) -> str:
    try:
        return value.strip() or repr(value) if isinstance(value, str) else repr(value)
    except ValueError:  # of too many digits
        return "of too many digits"


def state(scene: SimpleNamespace) -> tuple[Any, ...]:
    """Return what calls change: the versions of models and poses, and what can be changed."""
    context, instance = scene.context, scene.instance
    assert context.snapshot is not None  # new frames get their rows when somebody looks
    return (
        scene.graph._model.state.version,
        context.model_version,
        context.pose_version,
        _values(scene.properties),
        (instance.name(), repr(instance.shape()), instance.pose().tobytes()),
        _values(instance.proximity_properties()),
    )


def _values(properties: Any) -> Any:
    """Return all that properties hold, in the order of their names."""
    return properties and [
        (group, name, repr(value))
        for group in sorted(properties.get_group_names())
        for name, value in sorted(properties.get_properties_in_group(group).items())
    ]


def test_arguments_that_are_right():
    """With right arguments most calls answer, so that the fuzzer gets behind the first check."""
    refused = []
    for name, known in NAMES.items():
        scene = build()
        arguments = {p: RIGHT[p][0](scene) for p in known if p in RIGHT}
        try:
            named(scene, name)(**arguments)
        except (SceneGraphError, TypeError, ValueError):
            refused.append(name)
    assert len(refused) < len(NAMES) / 3, refused


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_arguments_of_every_kind():
    """Wrong arguments are refused in words that name them, and change nothing."""
    fuzz(Target("core", make, run), 4000)
