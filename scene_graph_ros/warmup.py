"""Compile every kernel of the core once: ``python -m scene_graph_ros.warmup``.

Compiled kernels are kept on disk (``geometry.compiled.cache``): later processes load them. The big
entry points are compiled in processes of their own, side by side; then one process asks every
query of a scene with every shape, which must find nothing left to compile. A second call does
only that.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
import queue
import subprocess
import sys
import threading
import time

from numba.core import event
import numpy as np

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    Ellipsoid,
    FrameId,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    IllustrationProperties,
    Mesh,
    ProximityProperties,
    QueryObject,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.broadphase.all_pairs import all_candidate_pairs
from scene_graph_ros.geometry.broadphase.hierarchical_grid import candidate_pairs
from scene_graph_ros.geometry.broadphase.pair_memory import PairMemory
from scene_graph_ros.geometry.compiled import cache, kernel
from scene_graph_ros.geometry.compiled.readiness import ready_marker
from scene_graph_ros.geometry.meshes.held_table import hold
from scene_graph_ros.geometry.meshes.shape_table import build_shape_table, ShapeTable
from scene_graph_ros.geometry.query.distance.certificate import certify_pairs
from scene_graph_ros.geometry.query.distance.driver import solve_pairs, WITHIN
from scene_graph_ros.geometry.query.distance.local_surface import local_surfaces
from scene_graph_ros.geometry.query.point.batch import distance_points
from scene_graph_ros.geometry.spatial.pose_kernels import check_poses
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions, quaternions_from_poses
from scene_graph_ros.geometry.spatial.record_kernels import are_valid, latest, place_records

__all__ = ["ask_everything", "main", "read_poses", "warm_up"]

_TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
_STAMP_SIZE = 8
_FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def _two_spheres() -> tuple[ShapeTable, np.ndarray]:
    table = build_shape_table([Sphere(1.0), Sphere(1.0)], [False, False])
    return table, np.tile(np.eye(4), (2, 1, 1))


def _compile_pairs() -> None:
    table, X_WG = _two_spheres()
    solve_pairs(hold(table), X_WG, np.array([[0, 1]]), 1.0, WITHIN)


def _compile_points() -> None:
    table, X_WG = _two_spheres()
    distance_points(table, X_WG, np.zeros((1, 3)), 1.0)
    distance_points(table, X_WG, np.zeros((2, 3)), np.inf)
    mesh = build_shape_table([Mesh(vertices=_TETRAHEDRON, faces=_FACES)], [False])
    distance_points(mesh, X_WG[:1], np.zeros((1, 3)), np.inf)
    vectors = np.zeros((1, 3))
    certify_pairs(
        table, X_WG, np.array([[0, 1]]), np.zeros(1), vectors, vectors, vectors, np.zeros(1)
    )
    rows, normals, smooth = np.array([0]), np.array([[0.0, 0.0, 1.0]]), np.zeros(1, np.bool_)
    local_surfaces(table, X_WG, rows, vectors, normals, smooth, vectors, np.zeros((1, 4)))


def _compile_candidates() -> None:
    table, X_WG = _two_spheres()
    lower, upper = world_boxes(table, X_WG)
    frame, bits = np.arange(2, dtype=np.int32), np.zeros((0, 0), dtype=np.uint8)
    for search in (candidate_pairs, all_candidate_pairs):
        search(lower, upper, np.zeros(2, dtype=np.bool_), X_WG, frame, bits, 0.0)
    pairs = PairMemory(table, frame, bits)
    for _ in range(2):  # the first search, and one that remembers it
        pairs.close_pairs(X_WG, 0.0)


def _compile_model() -> None:
    _scene_of_all_shapes().snapshot.X_WG  # noqa: B018
    read_poses()


def read_poses() -> None:
    """Read a pose as one comes with a message, in all the ways there are."""
    components = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    X = poses_from_quaternions(components[:, :3], components[:, 3:])
    quaternions_from_poses(X)
    check_poses(X)
    data = bytes(_STAMP_SIZE) + components.tobytes()
    numbers, rows = np.array([_STAMP_SIZE]), np.array([0])
    times, newest = np.array([0]), np.array([0])
    are_valid(data, numbers)
    place_records(data, numbers, times, (0, 0, 0), rows, X, newest)
    latest(newest)


def _soft_scene() -> tuple[QueryObject, GeometryId]:
    """Return queries of a scene with two deformable boxes on a floor and a box, and one's id."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    drawn = IllustrationProperties()
    drawn.add_property("deformable", "embedded_mesh", Mesh(vertices=_TETRAHEDRON, faces=_FACES))
    soft = []
    for k in range(2):
        instance = GeometryInstance(np.eye(4), Box(0.2 + 0.1 * k, 0.2, 0.2), f"soft_{k}")
        instance.set_proximity_properties(ProximityProperties())
        instance.set_illustration_properties(drawn)
        world = scene_graph.world_frame_id()
        soft.append(scene_graph.register_deformable_geometry(source, world, instance, 0.1))
    for name, shape in (("floor", HalfSpace()), ("box", Box(0.1, 0.1, 0.1))):
        rigid = GeometryInstance(np.eye(4), shape, name)
        rigid.set_proximity_properties(ProximityProperties())
        scene_graph.register_anchored_geometry(source, rigid)
    context = scene_graph.create_default_context()
    query = scene_graph.query_object(context)
    context.set_configurations(source, {soft[0]: 0.9 * query.get_configurations_in_world(soft[0])})
    return query, soft[0]


def _compile_deformable() -> None:
    query, soft = _soft_scene()
    query.compute_deformable_contact()
    query.get_driven_mesh_configurations_in_world(soft, Role.ILLUSTRATION)


def _compile_surfaces() -> None:
    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    soft, hard = ProximityProperties(), ProximityProperties()
    add_compliant_hydroelastic_properties(soft, 0.1, 1e6)
    add_rigid_hydroelastic_properties(hard, 0.1)
    bodies = [
        (Box(0.1, 0.2, 0.3), soft),
        (Convex(vertices=_TETRAHEDRON), soft),
        (Sphere(0.1), hard),
    ]
    for k, (shape, properties) in enumerate(bodies):
        frame = scene_graph.register_frame(source, GeometryFrame(f"frame_{k}"))
        instance = GeometryInstance(np.eye(4), shape, f"body_{k}")
        instance.set_proximity_properties(properties)
        scene_graph.register_geometry(source, frame, instance)
    query = scene_graph.query_object(scene_graph.create_default_context())
    surfaces = query.compute_contact_surfaces()
    surfaces.grad_pressure_M_W  # noqa: B018
    query.compute_contact_surfaces("polygon")


_TASKS: dict[str, Callable[[], None]] = {
    "pairs": _compile_pairs,
    "points": _compile_points,
    "candidates": _compile_candidates,
    "surfaces": _compile_surfaces,
    "deformable": _compile_deformable,
    "model": _compile_model,
}
"""The entry points, the slowest to compile first."""


def _scene_of_all_shapes() -> QueryObject:
    """Return queries of a scene with every shape twice, frames on frames, filters, a floor."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    shapes = [
        Sphere(0.1),
        Capsule(0.1, 0.2),
        Box(0.1, 0.2, 0.3),
        Cylinder(0.1, 0.2),
        Ellipsoid(0.1, 0.2, 0.3),
        Convex(vertices=_TETRAHEDRON),
        Mesh(vertices=_TETRAHEDRON, faces=_FACES),
        Mesh(vertices=_TETRAHEDRON, faces=_FACES, scale=(1.0, 1.0, 2.0)),
    ]
    properties = ProximityProperties()
    triangles = ProximityProperties()
    triangles.add_property("mesh", "representation", "triangles")
    frames: list[FrameId] = []
    geometries: list[GeometryId] = []
    for k, shape in enumerate(2 * shapes):
        parent = frames[-1] if k % 4 == 1 else None
        frame = scene_graph.register_frame(source, GeometryFrame(f"frame_{k}"), parent=parent)
        instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
        geometry = scene_graph.register_geometry(source, frame, instance)
        exact = isinstance(shape, Mesh) and k > len(shapes)
        scene_graph.assign_role(source, geometry, triangles if exact else properties)
        frames.append(frame)
        geometries.append(geometry)
    floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
    floor_id = scene_graph.register_anchored_geometry(source, floor)
    scene_graph.assign_role(source, floor_id, properties)
    declaration = CollisionFilterDeclaration().exclude_within(GeometrySet(geometries[:2]))
    scene_graph.collision_filter_manager().apply(declaration)
    context = scene_graph.create_default_context()
    X_PF = np.tile(np.eye(4), (len(frames), 1, 1))
    X_PF[:, :3, 3] = np.random.default_rng(0).uniform(-0.2, 0.2, (len(frames), 3))
    context.set_frame_poses(source, X_PF)
    context.set_frame_poses(source, {frames[0]: X_PF[0]})
    return scene_graph.query_object(context)


def ask_everything() -> None:
    """Ask every query of a scene with every shape."""
    query = _scene_of_all_shapes()
    query.find_collision_candidates()
    query.has_collisions()
    query.compute_point_pair_penetration(derivatives=True)
    pairs = query.compute_signed_distance_pairwise_closest_points(0.1)
    query.compute_signed_distance_pairwise_closest_points(derivatives=True)
    query.compute_signed_distance_pair_closest_points(pairs[0].id_A, pairs[0].id_B)
    query.compute_signed_distance_to_point([0.0, 0.0, 1.0])
    query.compute_signed_distance_to_points(np.zeros((3, 3)), 0.5)
    query.compute_signed_distance_to_points(np.zeros((50, 3)))
    _compile_surfaces()
    _compile_deformable()
    read_poses()


class _Reporter(event.Listener):
    """Prints the name of each kernel when it is compiled, for the process that counts."""

    def on_start(self, event: event.Event) -> None:
        """Do nothing."""

    def on_end(self, event: event.Event) -> None:
        """Print the kernel's name."""
        sys.stdout.write(f"{event.data['dispatcher'].__name__}\n")
        sys.stdout.flush()


def _run_task(name: str) -> None:
    event.register("numba:compile", _Reporter())
    _TASKS[name]()


def _follow(name: str, lines: queue.Queue[tuple[str, str | int]]) -> None:
    """Run a task in a process of its own and pass on what it prints, then its exit code."""
    command = [sys.executable, "-m", "scene_graph_ros.warmup", "--task", name]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:  # noqa: S603
        assert process.stdout is not None
        for line in process.stdout:
            lines.put((name, line.strip()))
        lines.put((name, process.wait()))


def _compile_side_by_side(processes: int) -> None:
    """Run all tasks, at most ``processes`` at a time, under a progress bar."""
    from tqdm import tqdm

    lines: queue.Queue[tuple[str, str | int]] = queue.Queue()
    waiting, running = list(_TASKS), 0
    total = kernel.kernel_count()
    with tqdm(total=total, desc="compiling kernels", unit="kernel", dynamic_ncols=True) as bar:
        seen: set[str] = set()
        while waiting or running:
            while waiting and running < processes:
                threading.Thread(target=_follow, args=(waiting.pop(0), lines), daemon=True).start()
                running += 1
            name, line = lines.get()
            if isinstance(line, int):
                running -= 1
                if line != 0:
                    raise RuntimeError(f"compiling {name!r} ended with exit code {line}")
            elif line not in seen:
                seen.add(line)
                bar.update(min(1, total - bar.n))
        bar.update(total - bar.n)


def warm_up(processes: int | None = None) -> int:
    """Compile what is not compiled yet.

    Args:
        processes: how many to use; by default one per processor, at most one per entry point.

    Returns:
        the number of kernels that this process itself had to compile: 0 when all was well.

    """
    marker = ready_marker()
    if not marker.exists():
        _compile_side_by_side(processes or min(len(_TASKS), os.cpu_count() or 1))
    before = kernel.compilation_count()
    ask_everything()
    marker.parent.mkdir(parents=True, exist_ok=True)
    marker.touch()
    return kernel.compilation_count() - before


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m scene_graph_ros.warmup", description=__doc__)
    parser.add_argument("--task", choices=sorted(_TASKS), help=argparse.SUPPRESS)
    parser.add_argument("--processes", type=int, help="how many to compile with")
    options = parser.parse_args(arguments)
    if options.task:
        _run_task(options.task)
        return 0
    start = time.perf_counter()
    late = warm_up(options.processes)
    elapsed = time.perf_counter() - start
    note = f" ({late} of them late)" if late else ""
    sys.stdout.write(f"kernels are ready in {cache.cache_root()}{note}: {elapsed:.1f} s\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
