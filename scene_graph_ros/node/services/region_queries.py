"""Answers about convex regions of the world; imported when one is first asked for."""

from __future__ import annotations

from collections import Counter
import math
import time
from typing import Any

from geometry_msgs.msg import Point
import numpy as np
from numpy.typing import NDArray

from msg_adapters.arrays import int64s_to_msg, uint8s_to_msg, uint32s_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.names import legend
from msg_adapters.regions import (
    outcome_of,
    point_from_msg,
    region_cuts_to_msg,
    region_from_msg,
    region_to_msg,
)
from msg_adapters.scene import geometry_set_from_msg
from scene_graph_ros.convex.iris.field_obstacles import count_sets
from scene_graph_ros.convex.iris.voxel_obstacles import count_voxel_sets
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.model.point_set import PointSet
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.voxel_set import VoxelSet
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    HPolyhedron,
    iris,
    IrisOptions,
    IrisRegion,
    RegionTest,
    SampleError,
    scene_obstacles,
    SceneObstacle,
    SolverError,
)
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import CONTACT_RESOLUTION
from scene_graph_ros.node.services.queries import QueryScope
from scene_graph_ros.node.world.kept_regions import KeptRegion

__all__ = ["check_regions", "grow_region", "ignored_geometry", "kept_region", "remove_regions"]


def grow_region(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer GrowRegion."""
    name = canonical_name("region", request.name) if request.name else ""
    ignored = ignored_geometry(request.ignored, scope)
    seed = point_from_msg(request.seed, "seed")
    domain = _domain(request, seed, scope)
    options = _options(request, scope)
    obstacles = _obstacles(scope, ignored, seed)
    try:
        found = iris(
            [each.convex_set for each in obstacles],
            seed,
            domain,
            options,
            certificate=True,
        )
    except SampleError as error:
        geometry = scope.snapshot.names.geometry_path(obstacles[error.obstacle].geometry_id)
        raise MessageError(f"seed {seed.tolist()} touches {geometry}, to rounding") from None
    except SolverError as error:
        raise MessageError(f"seed {seed.tolist()}: no region could be grown: {error}") from None
    _fill(response, found, obstacles, scope)
    is_late = found.reason == "termination_func"
    response.reason = "time" if is_late else found.reason
    response.region = region_to_msg(name, found.region)
    if name:
        kept = kept_region(name, found.region, ignored, "region", scope)
        most = scope.limit("max_regions")
        scope.regions().keep([kept], replace=request.replace, most=most)


def _fill(
    response: Any, found: IrisRegion, obstacles: list[SceneObstacle], scope: QueryScope
) -> None:
    response.ellipsoid_volumes = list(found.volumes)
    if found.ellipsoid is not None:
        x, y, z = found.ellipsoid.center.tolist()
        response.center = Point(x=x, y=y, z=z)
    ids = [int(obstacles[each.obstacle].geometry_id) for each in found.separations]
    response.separated_ids = int64s_to_msg(ids)
    response.separating_faces = uint32s_to_msg([each.row for each in found.separations])
    response.geometries = legend(scope.legend, ids)


def _domain(request: Any, seed: NDArray[np.float64], scope: QueryScope) -> HPolyhedron:
    """Return the domain of a region; it has the seed in it."""
    lower, upper = (
        point_from_msg(getattr(request, field), field) for field in ("domain_min", "domain_max")
    )
    for axis, low, high, at in zip("xyz", lower, upper, seed, strict=True):
        if not low < high:
            raise MessageError(
                f"domain_max.{axis} {high} must be more than domain_min.{axis} {low}"
            )
        if not low <= at <= high:
            raise MessageError(f"seed.{axis} {at} is outside the domain, from {low} to {high}")
    scope.require(
        "max_faces_per_region", 6 + len(request.domain_b), "domain_b: faces of the region"
    )
    faces = region_from_msg(request.domain_a, request.domain_b, "domain_a", "domain_b")
    over = faces.A @ seed - faces.b
    if (over > 0.0).any():
        face = int(over.argmax())
        raise MessageError(f"seed {seed.tolist()} is outside the domain, by its face {face}")
    return HPolyhedron.make_box(lower, upper).intersection(faces)


def _options(request: Any, scope: QueryScope) -> IrisOptions:
    longest = float(scope.limit("max_planning_time"))
    if not 0.0 <= request.time_limit < math.inf:
        raise MessageError(f"time_limit must be a number from 0 on, not {request.time_limit}")
    for field in ("termination_threshold", "relative_termination_threshold"):
        if math.isnan(getattr(request, field)):
            raise MessageError(f"{field} must be a number, not nan")
    if not request.iteration_limit:
        raise MessageError("iteration_limit must be at least 1, not 0")
    end = time.monotonic() + min(request.time_limit or longest, longest)
    asked: list[HPolyhedron] = []

    def is_late(region: HPolyhedron) -> bool:
        # The first region is taken, however long it took.
        asked.append(region)
        return len(asked) > 1 and time.monotonic() > end

    return IrisOptions(
        require_sample_point_is_contained=bool(request.keep_seed),
        iteration_limit=int(request.iteration_limit),
        termination_threshold=request.termination_threshold,
        relative_termination_threshold=request.relative_termination_threshold,
        verify_domain_boundedness=False,
        termination_func=is_late,
    )


def _obstacles(
    scope: QueryScope, ignored: frozenset[GeometryId], seed: NDArray[np.float64]
) -> list[SceneObstacle]:
    """Return the obstacles of all configurations; raises MessageError for a seed in one."""
    count = _count(scope)
    scope.require("max_pairs_per_request", count * len(scope.options.configurations), "obstacles")

    tol = CONTACT_RESOLUTION * max(1.0, float(np.abs(seed).max()))

    def of(query: QueryObject) -> list[tuple[Any, SceneObstacle]]:
        found = scene_obstacles(query, ignored)
        snapshot = query.snapshot
        poses = dict(zip(snapshot.proximity.geometry_ids, snapshot.X_WG, strict=True))
        clouds = snapshot.state.element_ids(Role.PROXIMITY)
        poses.update((each, snapshot.pose_in_world(each)) for each in clouds)
        for geometry_id, convex_set in found:
            if not convex_set.is_empty() and convex_set.point_in_set(seed, tol):
                raise MessageError(_collision(query, geometry_id, seed, scope))
        # What is where it was in another configuration is the same obstacle.
        seen: Counter[GeometryId] = Counter()
        keyed = []
        for each in found:
            place = poses[each.geometry_id].tobytes() if each.geometry_id in poses else b""
            keyed.append(((each.geometry_id, seen[each.geometry_id], place), each))
            seen[each.geometry_id] += 1  # a mesh has an obstacle a piece
        return keyed

    return list({key: each for found in scope.each(of) for key, each in found}.values())


def _count(scope: QueryScope) -> int:
    """Return the largest number of obstacles."""
    snapshot = scope.snapshot.query.snapshot
    now = [snapshot.element_set(each) for each in snapshot.state.element_ids(Role.PROXIMITY)]
    counts = [
        each.count
        if isinstance(each, PointSet)
        else count_voxel_sets(each)
        if isinstance(each, VoxelSet)
        else count_sets(each.shape)
        for each in now
    ]
    return len(snapshot.proximity.ids) + sum(counts)


def _collision(
    query: QueryObject, geometry_id: GeometryId, seed: NDArray[np.float64], scope: QueryScope
) -> str:
    """Return a sentence about a seed in a geometry, or in its hull, and the depth."""
    path = scope.snapshot.names.geometry_path(geometry_id)
    found = query.compute_signed_distance_to_point(seed, 0.0)
    depth = max((-each.distance for each in found if each.id_G == geometry_id), default=0.0)
    if depth > 0.0:
        return f"seed {seed.tolist()} is {1e3 * depth:.4g} mm deep in {path}"
    return f"seed {seed.tolist()} is in or at the convex hull of {path}, by which it counts"


def check_regions(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer CheckRegions."""
    extra = ignored_geometry(request.ignored, scope)
    regions = [
        kept_region(
            each.name,
            region_from_msg(each.a, each.b, f"regions[{k}].a", f"regions[{k}].b"),
            frozenset(),
            f"regions[{k}]",
            scope,
        )
        for k, each in enumerate(request.regions)
    ]
    asks_all = not request.names and not request.regions
    kept = scope.regions().named(request.names) if request.names or asks_all else []
    regions = [*kept, *regions]
    count = _count(scope) + 1
    count *= len(regions) * len(scope.options.configurations)
    scope.require("max_pairs_per_request", count, "regions times geometries")
    if asks_all and not extra and scope.options.configurations == ({},):
        followed = scope.regions().follow(scope.snapshot).regions
        rows: list[Any] = [cuts for _, (_, cuts) in sorted(followed.items())]
        response.names = sorted(followed)
    else:
        tables = scope.each(
            lambda query: [
                scope.tally.counted(each.test.cuts(query, ignored=each.ignored | extra))
                for each in regions
            ]
        )
        rows = [cuts for table in tables for cuts in table]
        response.names = [each.name for each in regions]
    response.outcomes = uint8s_to_msg([outcome_of(cuts) for cuts in rows])
    response.cuts = region_cuts_to_msg(rows, scope.legend)


def remove_regions(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer RemoveRegions."""
    response.names = scope.regions().remove(request.names)


def ignored_geometry(message: Any, scope: QueryScope) -> frozenset[GeometryId]:
    """Return the geometries of a set, those of its frames among them."""
    given = geometry_set_from_msg(message, scope.snapshot.names)
    inspector = scope.snapshot.inspector
    of_frames = (g for f in given.frame_ids() for g in inspector.get_geometries(f))
    return frozenset({*given.geometry_ids(), *of_frames})


def kept_region(
    name: str, region: HPolyhedron, ignored: frozenset[GeometryId], field: str, scope: QueryScope
) -> KeptRegion:
    """Return a region that can be kept; raises MessageError for one that is not a bounded one."""
    scope.require("max_faces_per_region", len(region.b), f"{field}: faces of the region")
    if region.is_empty():
        raise MessageError(
            f"{field} {quoted(name)} is empty: no point is on the inside of all faces"
        )
    try:
        return KeptRegion(name, region, ignored, RegionTest(region))
    except ConvexSetError:
        raise MessageError(
            f"{field} {quoted(name)} is unbounded: add the faces of a box around it"
        ) from None
