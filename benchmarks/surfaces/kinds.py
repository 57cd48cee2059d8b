"""The same balls on a table three ways: by points, by contact surfaces, deformable.

All balls touch the table. Before every query all balls move: rigid ones get poses, deformable ones
all their vertices.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import time
from typing import Any, NamedTuple

import numpy as np

from benchmarks.surfaces.cases import DEEPEST, HINTS, MODULUS
from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    Box,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)

__all__ = ["Kind", "kinds_table", "measure_kinds"]

_BALLS = 12
_DEPTH = 0.02
_SPACING = 3.0 * DEEPEST
_ROUNDS = 30
_HINTS = {"surfaces": HINTS[1:4], "deformable": HINTS[:3]}
"""A ball of a finer mesh has too many vertices for anyone to set them in time."""
_TABLE = Box(2.0 * _BALLS * _SPACING, 1.0, 0.1)


class Kind(NamedTuple):
    """What one ball costs in one of the ways."""

    name: str
    hint: float
    """Metres; NaN for points."""
    vertices: int
    """Numbers that are set per ball and update, in threes; a pose counts as none."""
    build_ms: float
    """Once, for the whole scene."""
    time_us: float
    """Per ball: move and query."""
    gives: str


class _Scene:
    """Balls in a row on a table."""

    def __init__(self) -> None:
        self.graph = SceneGraph()
        self.source = self.graph.register_source("benchmark")

    def add_table(self, properties: ProximityProperties) -> None:
        """Add the table, its top at z = 0."""
        X_WT = np.eye(4)
        X_WT[2, 3] = -0.05
        instance = GeometryInstance(X_WT, _TABLE, "table")
        table = self.graph.register_anchored_geometry(self.source, instance)
        self.graph.assign_role(self.source, table, properties)

    def add_balls(self, properties: Callable[[], ProximityProperties]) -> np.ndarray:
        """Add rigid-bodied balls; return two sets of poses (2, n, 4, 4)."""
        for k in range(_BALLS):
            frame = self.graph.register_frame(self.source, GeometryFrame(f"frame {k}"))
            instance = GeometryInstance(np.eye(4), Sphere(DEEPEST), f"ball {k}")
            ball = self.graph.register_geometry(self.source, frame, instance)
            self.graph.assign_role(self.source, ball, properties())
        sets = np.tile(np.eye(4), (2, _BALLS, 1, 1))
        sets[:, :, :3, 3] = _centres()
        return sets


def _centres() -> np.ndarray:
    """Return (2, n, 3): where the balls are at first, and a step later."""
    centres = np.zeros((2, _BALLS, 3))
    centres[..., 0] = _SPACING * (np.arange(_BALLS) - 0.5 * _BALLS)
    centres[..., 2] = DEEPEST - _DEPTH
    centres[1] += [1e-3, -2e-3, 1e-4]
    return centres


def _timed(begin: float, move: Callable[[int], None], ask: Callable[[], Any]) -> tuple[float, ...]:
    """Return the ms from ``begin`` to the first answer, and the us per ball of the fastest."""
    move(0)
    ask()
    built = time.perf_counter() - begin
    least = np.inf
    for k in range(1, _ROUNDS):
        start = time.perf_counter()
        move(k % 2)
        ask()
        least = min(least, time.perf_counter() - start)
    return 1e3 * built, 1e6 * least / _BALLS


def _points() -> Kind:
    begin = time.perf_counter()
    scene = _Scene()
    scene.add_table(ProximityProperties())
    sets = scene.add_balls(ProximityProperties)
    context = scene.graph.create_default_context()
    query = scene.graph.query_object(context)
    built, each = _timed(
        begin,
        lambda k: context.set_frame_poses(scene.source, sets[k]),
        query.compute_point_pair_penetration,
    )
    return Kind("points", np.nan, 0, built, each, "one point, normal, depth")


def _surfaces(hint: float) -> Kind:
    def properties() -> ProximityProperties:
        result = ProximityProperties()
        add_compliant_hydroelastic_properties(result, hint, MODULUS)
        return result

    begin = time.perf_counter()
    scene = _Scene()
    rigid = ProximityProperties()
    add_rigid_hydroelastic_properties(rigid)
    scene.add_table(rigid)
    sets = scene.add_balls(properties)
    context = scene.graph.create_default_context()
    query = scene.graph.query_object(context)
    built, each = _timed(
        begin,
        lambda k: context.set_frame_poses(scene.source, sets[k]),
        lambda: query.compute_contact_surfaces("polygon"),
    )
    faces = float(np.mean(query.compute_contact_surfaces("polygon").num_faces))
    return Kind("surfaces", hint, 0, built, each, f"force, area, pressure on {faces:.0f} polygons")


def _deformables(hint: float) -> Kind:
    begin = time.perf_counter()
    scene = _Scene()
    rigid = ProximityProperties()
    add_rigid_hydroelastic_properties(rigid)
    scene.add_table(rigid)
    balls = []
    for k in range(_BALLS):
        instance = GeometryInstance(np.eye(4), Sphere(DEEPEST), f"ball {k}")
        world = scene.graph.world_frame_id()
        ball = scene.graph.register_deformable_geometry(scene.source, world, instance, hint)
        scene.graph.assign_role(scene.source, ball, ProximityProperties())
        balls.append(ball)
    context = scene.graph.create_default_context()
    query = scene.graph.query_object(context)
    reference = {ball: np.array(query.get_configurations_in_world(ball)) for ball in balls}
    sets = [
        {ball: reference[ball] + centre for ball, centre in zip(balls, centres, strict=True)}
        for centres in _centres()
    ]
    built, each = _timed(
        begin,
        lambda k: context.set_configurations(scene.source, sets[k]),
        query.compute_deformable_contact,
    )
    contact = query.compute_deformable_contact()
    faces = np.mean([len(surface.signed_distances) for surface in contact])
    vertices = len(reference[balls[0]])
    gives = f"signed distance and weights of vertices on {faces:.0f} polygons"
    return Kind("deformable", hint, vertices, built, each, gives)


def measure_kinds() -> Iterator[Kind]:
    """Yield what a ball on a table costs in each way; kernels are compiled before."""
    for make in (_surfaces, _deformables):
        make(HINTS[0])
    _points()
    yield _points()
    for name, make in (("surfaces", _surfaces), ("deformable", _deformables)):
        for hint in _HINTS[name]:
            yield make(hint)


def _digits(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def kinds_table(kinds: Sequence[Kind]) -> str:
    """Return a Markdown table of them."""
    lines = [
        f"| one of {_BALLS} balls on a table | `resolution_hint` | per update (µs) |"
        " built once, all (ms) | set per update | gives |",
        "| --- | ---: | ---: | ---: | ---: | --- |",
    ]
    for kind in kinds:
        part = round(DEEPEST / kind.hint) if np.isfinite(kind.hint) else 0
        hint = ("", "the radius")[part] if part < 2 else f"1/{part} of the radius"
        numbers = "a pose" if kind.vertices == 0 else f"{kind.vertices} vertices"
        times = f"{_digits(kind.time_us)} | {_digits(kind.build_ms)}"
        lines.append(f"| {kind.name} | {hint} | {times} | {numbers} | {kind.gives} |")
    return "\n".join(lines) + "\n"
