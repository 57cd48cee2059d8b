"""The questions one can ask a scene; each is answered in a folder of its own, `ask.py`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import math
from typing import Protocol, TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.no_copies import NotCopied
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.boxes import compute_aabb_in_world
from scene_graph_ros.geometry.query.candidates import ask as candidates
from scene_graph_ros.geometry.query.distance import ask as distance
from scene_graph_ros.geometry.query.memo import Memo
from scene_graph_ros.geometry.query.on_demand import on_demand
from scene_graph_ros.geometry.query.penetration import ask as penetration
from scene_graph_ros.geometry.query.point import ask as point
from scene_graph_ros.geometry.query.render_queries import RenderQueries
from scene_graph_ros.geometry.query.representation import as_representation, ContactRepresentation
from scene_graph_ros.geometry.query.results import (
    CandidatePairs,
    Penetrations,
    PointDistances,
    SignedDistancePair,
    SignedDistancePairs,
)

if TYPE_CHECKING:
    from scene_graph_ros.geometry.deformable.results import DeformableContact
    from scene_graph_ros.geometry.hydroelastic.contact_surface import ContactSurfaces

__all__ = ["QueryObject"]

Answer = TypeVar("Answer")


class _Provider(Protocol):
    """An object with a current snapshot: a Context, or a Snapshot itself."""

    @property
    def snapshot(self) -> Snapshot: ...


class QueryObject(RenderQueries, NotCopied):
    """Queries about geometries with the proximity role, in the world frame W.

    In a notebook it shows its scene, with contacts, to be turned and clicked at.

    A *live* query object follows its context; ``bake`` freezes the present. Results never change
    and are sorted by id, the same for the same poses. Any number of threads may ask at once; the
    computation does not hold the interpreter's lock.

    Pairs on the same frame, pairs of anchored geometries and pairs excluded by a collision filter
    are not reported. Deformable geometries are left out of all but the queries about them. A
    ``Mesh`` stands for its convex hull between pairs unless its proximity properties ask for
    triangles, and always for its triangles against points.

    How exact the answers about pairs are is the model's ``accuracy``, unless a query says
    otherwise: "quick", "standard" or "exact" promise that a distance is off by no more than 1e-3,
    1e-6 or 1e-12 of the pair's larger shape. Which pairs penetrate does not depend on it. Points
    are exact at every tier. With ``certificate`` the records have ``gap`` (m): the answer's own
    proven bound of its error, and ``decided_by``: the algorithm, see ``SignedDistancePair``.
    ``engine="fcl"`` asks FCL instead, for comparison: see ``distance.fcl_engine``. Names of no
    tier or engine raise QueryArgumentError, questions that the engine lacks EngineError.
    """

    _instead = "bake() freezes the present, which any thread may ask; results pickle as they are"

    def __init__(self, provider: _Provider) -> None:
        """Ask ``provider``, a Context (live) or a Snapshot (baked)."""
        self._provider = provider
        self._last: Memo | None = None

    def __repr__(self) -> str:
        return f"QueryObject({self._provider.snapshot.state.summary()})"

    def _repr_html_(self) -> str:
        html: str = on_demand("cell_html")(self)
        return html

    def _memo(self) -> Memo:
        snapshot = self._provider.snapshot
        last = self._last
        if last is None or last.snapshot is not snapshot:
            last = self._last = Memo(snapshot)
        return last

    @property
    def snapshot(self) -> Snapshot:
        """The moment that is asked about; a live query object's changes with its context."""
        return self._provider.snapshot

    def bake(self) -> QueryObject:
        """Return a query object that keeps answering for the present model and poses."""
        memo = self._memo()
        result = QueryObject(memo.snapshot)
        result._last = memo
        return result

    def with_unknown_voxels(self, *, is_free: bool) -> QueryObject:
        """Return a query object about the present in which unknown voxels count as free, or not.

        That holds for all voxel grids, whatever their shapes say. The bits of a grid that answer
        are made when first asked for, once for each way. Checkers take its ``snapshot``.
        """
        snapshot = self._provider.snapshot
        asked = snapshot.with_unknown_voxels(is_free=is_free)
        return self.bake() if asked is snapshot else QueryObject(asked)

    @property
    def accuracy(self) -> Accuracy:
        """The tier of answers that are not asked for otherwise: the model's."""
        return self._provider.snapshot.state.accuracy

    @property
    def engine(self) -> Engine:
        """The engine that answers about pairs by default: the model's choice."""
        return self._provider.snapshot.state.engine

    def inspector(self) -> SceneGraphInspector:
        """Return an inspector of the model as this query object sees it now."""
        return self._provider.snapshot.inspector

    def get_pose_in_world(self, target: FrameId | GeometryId) -> NDArray[np.float64]:
        """Return ``X_WF`` or ``X_WG`` ``(4, 4)``.

        Raises UnknownIdError, and DeformableError for a deformable geometry.
        """
        return self._provider.snapshot.pose_in_world(target)

    def get_pose_in_parent(self, frame_id: FrameId) -> NDArray[np.float64]:
        """Return ``X_PF`` ``(4, 4)`` in the parent frame. Raises UnknownIdError."""
        return self._provider.snapshot.pose_in_parent(frame_id)

    def compute_aabb_in_world(
        self, geometry_id: GeometryId
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the lower and the upper corner ``(3,)`` in W of a box around a geometry, in m.

        It is tight but for rounding, and but for hulls of many vertices, of whose box in G it is
        the box. None for half spaces and for clouds without points. Raises UnknownIdError, and
        RoleError for a rigid geometry without the proximity role.
        """
        return compute_aabb_in_world(self._memo(), geometry_id)

    def get_configurations_in_world(self, geometry_id: GeometryId) -> NDArray[np.float64]:
        """Return the positions of a deformable geometry's vertices in W, ``(v, 3)``, in m.

        The array is read-only. Raises UnknownIdError, and DeformableError for a rigid geometry.
        """
        return self._provider.snapshot.configuration(geometry_id).q_WG

    def get_driven_mesh_configurations_in_world(
        self, geometry_id: GeometryId, role: Role
    ) -> list[NDArray[np.float64]]:
        """Return the vertices of a role's driven meshes in W: ``(n, 3)`` each, in m.

        The inspector's get_driven_meshes returns the same meshes with their triangles. Raises
        UnknownIdError, DeformableError for a rigid geometry, and RoleError if it lacks the role.
        """
        return self._provider.snapshot.driven_mesh_configurations(geometry_id, role)

    def ask_what_if(
        self,
        configurations: Sequence[Mapping[FrameId, ArrayLike]],
        question: Callable[[QueryObject], Answer],
        *,
        threads: int = 1,
    ) -> list[Answer]:
        """Return the answers of ``question`` for each of many configurations of the scene.

        Each gives poses ``X_PF`` ``(4, 4)`` of some frames; nothing is moved. ``question`` gets a
        query object of it, as in ``query.ask_what_if(poses, QueryObject.has_collisions)``;
        `ask_what_if` says more, and names the errors.
        """
        answers: list[Answer] = on_demand("ask_what_if")(
            self, configurations, question, threads=threads
        )
        return answers

    def find_collision_candidates(self) -> CandidatePairs:
        """Return the pairs whose bounding boxes meet; any pair not in it is apart."""
        return candidates.find_collision_candidates(self._memo())

    def has_collisions(
        self, *, accuracy: Accuracy | str | None = None, engine: Engine | str | None = None
    ) -> bool:
        """Tell whether any pair penetrates, as in ``compute_point_pair_penetration``.

        Raises UnsupportedPairError as that does, unless a collision is met before.
        """
        return penetration.has_collisions(self._memo(), accuracy, engine)

    def compute_point_pair_penetration(
        self,
        *,
        derivatives: bool = False,
        certificate: bool = False,
        accuracy: Accuracy | str | None = None,
        engine: Engine | str | None = None,
    ) -> Penetrations:
        """Return all penetrating pairs with depth, witness points and normal.

        Touching, to within OSCULATION of the larger shape's size, is no penetration. With
        ``derivatives`` the records carry those of the distance with respect to both poses.

        Raises:
            UnsupportedPairError: two half spaces, not both anchored and not filtered.

        """
        return penetration.compute_point_pair_penetration(
            self._memo(), derivatives, certificate, accuracy, engine
        )

    def compute_contact_surfaces(
        self, representation: ContactRepresentation | str = ContactRepresentation.TRIANGLE
    ) -> ContactSurfaces:
        """Return the contact surfaces of all pairs in contact, with their pressure.

        Pairs need hydroelastic properties: one side compliant, the other compliant or rigid.

        Raises:
            QueryArgumentError: ``representation`` is neither "triangle" nor "polygon".
            UnsupportedPairError: a pair penetrates that has no contact surface.

        """
        query, word = "compute_contact_surfaces", as_representation(representation)
        return self._memo().get((query, word), on_demand(query), word)

    def compute_contact_surfaces_with_fallback(
        self, representation: ContactRepresentation | str = ContactRepresentation.TRIANGLE
    ) -> tuple[ContactSurfaces, Penetrations]:
        """Return contact surfaces where pairs have one, and penetrations where they have none.

        Raises:
            QueryArgumentError: ``representation`` is neither "triangle" nor "polygon".
            UnsupportedPairError: two half spaces, not both anchored and not filtered.

        """
        query = "compute_contact_surfaces_with_fallback"
        word = as_representation(representation)
        return self._memo().get((query, word), on_demand(query), word)

    def compute_deformable_contact(self) -> DeformableContact:
        """Return the contacts of deformable geometries with rigid and other deformable ones.

        Pairs with a deformable geometry need the proximity role and not to be filtered; they are
        checked also where the rigid one is anchored. Whether a rigid one is compliant has no part
        in it; a curved one is triangulated with its resolution_hint, or a tenth of its size.

        Raises:
            MeshError: a rigid surface would have too many triangles.

        """
        query = "compute_deformable_contact"
        return self._memo().get(query, on_demand(query))

    def compute_signed_distance_pairwise_closest_points(
        self,
        max_distance: float = math.inf,
        *,
        derivatives: bool = False,
        certificate: bool = False,
        accuracy: Accuracy | str | None = None,
        engine: Engine | str | None = None,
    ) -> SignedDistancePairs:
        """Return the signed distance of all pairs with ``distance <= max_distance`` (metres).

        Without ``max_distance`` the cost grows with the square of the number of geometries.

        Raises:
            QueryArgumentError: ``max_distance`` is not a number.
            UnsupportedPairError: two half spaces, not both anchored and not filtered.

        """
        return distance.compute_signed_distance_pairwise_closest_points(
            self._memo(), max_distance, derivatives, certificate, accuracy, engine
        )

    def compute_signed_distance_pair_closest_points(
        self,
        id_A: GeometryId,
        id_B: GeometryId,
        *,
        derivatives: bool = False,
        certificate: bool = False,
        accuracy: Accuracy | str | None = None,
        engine: Engine | str | None = None,
    ) -> SignedDistancePair:
        """Return the signed distance of one pair, filtered or not.

        In the result, A is the geometry with the smaller id.

        Raises:
            UnknownIdError: an id is not registered.
            RoleError: a geometry has no proximity role.
            DeformableError: a geometry is deformable.
            UnsupportedPairError: the ids are the same, or both are half spaces.

        """
        return distance.compute_signed_distance_pair_closest_points(
            self._memo(), id_A, id_B, derivatives, certificate, accuracy, engine
        )

    def compute_signed_distance_to_point(
        self,
        p_WQ: ArrayLike,
        threshold: float = math.inf,
        *,
        accuracy: Accuracy | str | None = None,
        engine: Engine | str | None = None,
    ) -> PointDistances:
        """Return the signed distance of point Q to every geometry, up to ``threshold`` (metres).

        Raises:
            QueryArgumentError: ``p_WQ`` is not three finite numbers, or ``threshold`` no number.

        """
        return point.compute_signed_distance_to_point(
            self._memo(), p_WQ, threshold, accuracy, engine
        )

    def compute_signed_distance_geometry_to_point(
        self,
        p_WQ: ArrayLike,
        geometries: GeometrySet,
        *,
        accuracy: Accuracy | str | None = None,
        engine: Engine | str | None = None,
    ) -> PointDistances:
        """Return the signed distance of point Q to the geometries of a set, at any distance.

        Geometries of its frames count with the proximity role. Raises QueryArgumentError for a bad
        point, UnknownIdError for ids that name nothing, and RoleError for a geometry of the set
        that has no proximity role or is deformable.
        """
        return point.compute_signed_distance_geometry_to_point(
            self._memo().snapshot, p_WQ, geometries, accuracy, engine
        )

    def compute_signed_distance_to_points(
        self,
        p_WQs: ArrayLike,
        threshold: float = math.inf,
        *,
        threads: int = 1,
        accuracy: Accuracy | str | None = None,
        engine: Engine | str | None = None,
    ) -> PointDistances:
        """Return the signed distances of points ``(m, 3)`` to every geometry, up to ``threshold``.

        The field ``point`` of a record is the index of its point. ``threads`` share the points;
        the answers are the same for any number of them. Raises QueryArgumentError as
        ``compute_signed_distance_to_point`` does, and for ``threads`` that is no integer >= 1.
        """
        return point.compute_signed_distance_to_points(
            self._memo().snapshot, p_WQs, threshold, threads, accuracy, engine
        )
