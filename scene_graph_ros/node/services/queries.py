"""Answers to query requests: pure functions of a request and a snapshot, without rclpy.

Each handler fills the response of one service type. Errors are raised; the services turn them into
statuses.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
import importlib
from typing import Any, TYPE_CHECKING, TypeVar

import numpy as np

from msg_adapters.errors import MessageError, UnavailableError
from msg_adapters.poses import poses_to_msg
from msg_adapters.queries import (
    candidates_to_msg,
    flags_to_msg,
    limit_from_msg,
    Options,
    options_from_msg,
    point_contacts_to_msg,
    point_distances_to_msg,
    points_from_msg,
    signed_distance_pair_to_msg,
    signed_distances_to_msg,
)
from msg_adapters.status import status_from_exception
from scene_graph_msgs.msg import SignedDistancePair
from scene_graph_ros.geometry.errors import (
    NameConflictError,
    UnknownIdError,
    UnsupportedPairError,
)
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.results import SignedDistancePairs
from scene_graph_ros.geometry.query.what_if import ask_what_if
from scene_graph_ros.node.effects.demand import CLOUDS
from scene_graph_ros.node.services.tally import (
    points_within,
    require,
    signed_distances_within,
    Tally,
)
from scene_graph_ros.node.world.world import WorldSnapshot

if TYPE_CHECKING:
    from scene_graph_ros.node.world.kept_regions import KeptRegions

__all__ = ["QUERIES", "Query", "QueryScope", "kernels_of_clouds"]

T = TypeVar("T")


def _no_topics(snapshot: WorldSnapshot, noun: str) -> Mapping[str, str]:
    return {}


def _no_regions() -> KeptRegions:
    raise UnavailableError("regions are kept by a node alone")


def _no_text(resource: str) -> tuple[str, str]:
    raise UnavailableError(f"{resource}: files are read by a node alone")


@dataclass
class QueryScope:
    """The base of an answer: a snapshot, the options of the request, and the limits.

    ``topics`` returns a snapshot's topics by source, for "poses" or "configurations",
    ``regions`` the kept regions, ``text`` the path and the text of a file; ``tally`` counts the
    rows of the answer while it is computed.
    """

    snapshot: WorldSnapshot
    options: Options
    limit: Callable[[str], Any]
    topics: Callable[[WorldSnapshot, str], Mapping[str, str]] = _no_topics
    regions: Callable[[], KeptRegions] = _no_regions
    text: Callable[[str], tuple[str, str]] = _no_text
    tally: Tally = field(init=False)

    def __post_init__(self) -> None:
        self.tally = Tally(self.limit)

    def read_options(self, request: Any) -> None:
        """Take the options that a request has. Raises the errors of ``options_from_msg``."""
        if hasattr(request, "options"):
            most = self.limit("max_configurations_per_request")
            snapshot = self.snapshot
            self.options = options_from_msg(
                request.options,
                snapshot.names,
                max_configurations=most,
                is_joint=lambda path: snapshot.joint_stamp(path) is not None,
            )

    def each(self, question: Callable[[QueryObject], T]) -> list[T]:
        """Return the answers to ``question`` for each configuration, in order.

        As many threads share them as the node's parameter ``query_threads`` says.
        """
        configurations = self.options.configurations
        if len(configurations) == 1 and not configurations[0]:
            # The world as it is, of which answers are remembered.
            return [question(self.snapshot.query)]
        threads = self.limit("query_threads")
        return ask_what_if(self.snapshot.query, configurations, question, threads=threads)

    def ask(self, query: QueryObject, question: Callable[..., T], *arguments: Hashable) -> T:
        """Return the answer of a method of ``QueryObject`` about one of the configurations.

        About the world as it is, threads that ask the same share the answer.
        """
        if query is self.snapshot.query:
            return self.snapshot.ask(question, *arguments)
        return question(query, *arguments)

    @property
    def legend(self) -> Any:
        """The names for tables, or None where they are not wanted."""
        return self.snapshot.names if self.options.with_names else None

    def require(self, parameter: str, count: int, what: str) -> None:
        """Raise TooLargeError where ``count`` is over the node's limit."""
        require(self.limit, parameter, count, what)


Handler = Callable[[Any, Any, QueryScope], None]


def _possible_pairs(scope: QueryScope) -> int:
    """Bound the number of pairs that the scene has, all configurations together."""
    snapshot = scope.snapshot.query.snapshot
    anchored = np.asarray(snapshot.proximity.is_anchored)
    count, moving = len(anchored), int(np.count_nonzero(~anchored.astype(bool)))
    clouds = snapshot.state.element_ids(Role.PROXIMITY)
    count += len(clouds)
    moving += sum(not snapshot.inspector.is_anchored(each) for each in clouds)
    pairs = moving * (count - moving) + moving * (moving - 1) // 2
    return pairs * len(scope.options.configurations)


def penetration(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer ComputePointPairPenetration."""
    question = QueryObject.compute_point_pair_penetration
    tables = scope.each(lambda query: scope.tally.counted(scope.ask(query, question)))
    response.table = point_contacts_to_msg(tables, scope.legend)


def signed_distances(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer ComputeSignedDistancePairwise."""
    limit = limit_from_msg(request.max_distance, "max_distance")
    if np.isinf(limit):
        scope.require("max_rows_per_response", _possible_pairs(scope), "pairs of the scene")
    tally, pairs = scope.tally, _possible_pairs(scope)
    question = QueryObject.compute_signed_distance_pairwise_closest_points

    def answer(query: QueryObject) -> SignedDistancePairs:
        if pairs > tally.most_rows:
            return signed_distances_within(query, limit, tally)
        return tally.counted(scope.ask(query, question, limit))

    tables = scope.each(answer)
    response.table = signed_distances_to_msg(tables, scope.legend)


def signed_distance_pairs(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer ComputeSignedDistancePair: each pair has a status of its own."""
    if len(request.geometries_a) != len(request.geometries_b):
        raise MessageError(
            f"geometries_a has {len(request.geometries_a)} entries, geometries_b "
            f"{len(request.geometries_b)}"
        )
    if len(request.ids_a) != len(request.ids_b):
        raise MessageError(f"ids_a has {len(request.ids_a)} entries, ids_b {len(request.ids_b)}")
    wanted = [
        *zip(request.geometries_a, request.geometries_b, strict=True),
        *zip(request.ids_a, request.ids_b, strict=True),
    ]
    count = len(wanted) * len(scope.options.configurations)
    scope.require("max_pairs_per_request", count, "pairs")
    names = scope.snapshot.names
    for pairs in scope.each(lambda query: [_pair(query, a, b, names) for a, b in wanted]):
        response.pairs.extend(pairs)


def _pair(query: QueryObject, a: Any, b: Any, names: Any) -> SignedDistancePair:
    """Answer for one pair; its errors are its own status, not the request's."""
    try:
        id_A, id_B = sorted((names.geometry_id(a), names.geometry_id(b)))
    except (UnknownIdError, NameConflictError) as error:
        return SignedDistancePair(status=status_from_exception(error))
    try:
        record = query.compute_signed_distance_pair_closest_points(id_A, id_B)
    except (UnsupportedPairError, ValueError) as error:
        return SignedDistancePair(
            status=status_from_exception(error),
            geometry_a=names.geometry_name(id_A),
            geometry_b=names.geometry_name(id_B),
        )
    snapshot = query.snapshot
    return signed_distance_pair_to_msg(
        record, names, snapshot.pose_in_world(id_A), snapshot.pose_in_world(id_B)
    )


def point_distances(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer ComputeSignedDistanceToPoint."""
    count = len(request.points) // 3 * len(scope.options.configurations)
    scope.require("max_points_per_request", count, "points")
    points = points_from_msg(request.points)
    threshold = limit_from_msg(request.threshold, "threshold")
    if np.isinf(threshold):
        snapshot = scope.snapshot.query.snapshot
        geometries = len(snapshot.proximity.ids) + len(snapshot.state.element_ids(Role.PROXIMITY))
        scope.require("max_rows_per_response", count * geometries, "points times geometries")
    # Many points of one configuration are shared, or else the configurations.
    threads = scope.limit("query_threads") if len(scope.options.configurations) == 1 else 1
    tables = scope.each(
        lambda query: points_within(query, points, threshold, threads, scope.tally)
    )
    response.table = point_distances_to_msg(tables, scope.legend)


def candidates(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer FindCollisionCandidates."""
    question = QueryObject.find_collision_candidates
    tables = scope.each(lambda query: scope.tally.counted(scope.ask(query, question)))
    response.table = candidates_to_msg(tables, scope.legend)


def collisions(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer HasCollisions."""
    question = QueryObject.has_collisions
    response.has_collisions = flags_to_msg(scope.each(lambda query: scope.ask(query, question)))


def poses(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer GetPoseInWorld."""
    names = scope.snapshot.names
    wanted: list[Any] = [names.frame_id(frame) for frame in request.frames]
    wanted += [names.geometry_id(reference) for reference in request.geometries]
    count = len(wanted) * len(scope.options.configurations)
    scope.require("max_rows_per_response", count, "poses")
    X_W = scope.each(lambda query: [query.snapshot.pose_in_world(item) for item in wanted])
    response.poses = poses_to_msg(np.array(X_W).reshape(-1, 4, 4))


def filtered(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer IsCollisionFiltered."""
    if len(request.a) != len(request.b):
        raise MessageError(f"a has {len(request.a)} entries, b {len(request.b)}")
    scope.require("max_pairs_per_request", len(request.a), "pairs")
    names, inspector = scope.snapshot.names, scope.snapshot.inspector
    response.is_filtered = flags_to_msg(
        inspector.collision_filtered(names.geometry_id(a), names.geometry_id(b))
        for a, b in zip(request.a, request.b, strict=True)
    )


def _on_demand(name: str, module_name: str = "surface_queries") -> Handler:
    """Return a handler of a module of the node, which is imported when it is first called."""

    def handler(request: Any, response: Any, scope: QueryScope) -> None:
        module = importlib.import_module(f"scene_graph_ros.node.services.{module_name}")
        getattr(module, name)(request, response, scope)

    return handler


@dataclass(frozen=True)
class Query:
    """A query service: its handler, and the effect that its time is booked under.

    ``kernels`` names the group of kernels that it needs beside the main job's; ``measures`` says
    that it asks about pairs of geometry, which needs those of clouds where a scene has some.
    """

    handler: Handler
    effect: str = ""
    kernels: str = ""
    measures: bool = True

    def kernel_groups(self, snapshot: WorldSnapshot) -> tuple[str, ...]:
        """Return the groups of kernels that it needs for a scene beside the main job's."""
        clouds = kernels_of_clouds(snapshot) if self.measures else ()
        return (self.kernels, *clouds) if self.kernels else clouds


def kernels_of_clouds(snapshot: WorldSnapshot) -> tuple[str, ...]:
    """Return the group of kernels that measures clouds and fields, of a scene that has some."""
    return (CLOUDS,) if snapshot.has_elements else ()


def _of_planning(name: str) -> Query:
    return Query(_on_demand(name, "planning_queries"), "planning", "planning")


def _of_regions(name: str, module_name: str = "region_queries") -> Query:
    return Query(_on_demand(name, module_name), "region_requests", "convex")


QUERIES: dict[str, Query] = {
    "CheckClearance": _of_planning("check_clearance"),
    "CheckConfigurations": _of_planning("check_configurations"),
    "CheckEdges": _of_planning("check_edges"),
    "CheckRegions": _of_regions("check_regions"),
    "ComputeContactSurfaces": Query(_on_demand("contact_surfaces"), kernels="surfaces"),
    "ComputeDeformableContact": Query(_on_demand("deformable_contact"), kernels="deformable"),
    "ComputePointPairPenetration": Query(penetration),
    "ComputeSignedDistancePair": Query(signed_distance_pairs, "signed_distance"),
    "ComputeSignedDistancePairwise": Query(signed_distances, "signed_distance"),
    "ComputeSignedDistanceToPoint": Query(point_distances, "point_distance"),
    "DescribeScene": Query(_on_demand("describe", "scene_description"), measures=False),
    "FindCollisionCandidates": Query(candidates),
    "GetDeformableConfigurations": Query(_on_demand("deformable_configurations"), measures=False),
    "GetPoseInWorld": Query(poses, measures=False),
    "GrowRegion": _of_regions("grow_region"),
    "HasCollisions": Query(collisions),
    "IsCollisionFiltered": Query(filtered, measures=False),
    "LoadRegions": _of_regions("load_regions", "region_files"),
    "RemoveRegions": _of_regions("remove_regions"),
    "RenderImages": Query(
        _on_demand("render_images", "camera_queries"), kernels="cameras", measures=False
    ),
    "SaveRegions": _of_regions("save_regions", "region_files"),
}
