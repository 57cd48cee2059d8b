"""The scene graph: where sources register frames and geometry."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, TYPE_CHECKING, TypeVar

from scene_graph_ros.geometry.accuracy import Accuracy, as_accuracy, as_engine, Engine
from scene_graph_ros.geometry.model import alteration, registration, removal
from scene_graph_ros.geometry.model.collision_filter import (
    CollisionFilterDeclaration,
    CollisionFilterManager,
)
from scene_graph_ros.geometry.model.context import Context
from scene_graph_ros.geometry.model.frame import GeometryFrame
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.instance import checked_shape, GeometryInstance
from scene_graph_ros.geometry.model.no_copies import NotCopied
from scene_graph_ros.geometry.model.owner import ModelOwner
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.model.proximity import read_mesh_data
from scene_graph_ros.geometry.model.records import WORLD_FRAME_ID
from scene_graph_ros.geometry.model.reference_meshes import make_deformable, read_embedded_meshes
from scene_graph_ros.geometry.model.renderer_registry import RendererRegistry
from scene_graph_ros.geometry.model.role_data import read_for_role, read_looks
from scene_graph_ros.geometry.model.roles import Role, RoleAssign
from scene_graph_ros.geometry.model.scene_config import SceneGraphConfig
from scene_graph_ros.geometry.model.scene_settings import checked_config, SceneSettings
from scene_graph_ros.geometry.model.state import GeometryState, ROLES
from scene_graph_ros.geometry.shapes.shape import Shape

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
    from scene_graph_ros.geometry.query.query_object import QueryObject

__all__ = ["SceneGraph"]

Result = TypeVar("Result")


class SceneGraph(SceneSettings, RendererRegistry, NotCopied):
    """The model of the world, from which contexts are made.

    Every method that changes the model takes ``context``: without it the scene graph's own model
    changes and contexts that exist keep theirs; with it that context's model changes, and neither
    the scene graph nor any other context. A method that raises has changed nothing; one that is
    interrupted has changed all that it is about, or nothing.

    In a notebook it shows its geometry, every frame at the identity in its parent.

    Sources change only objects that they registered themselves; OwnershipError otherwise.
    UnknownIdError is raised for an id that names nothing.
    """

    _instead = (
        "clone() and copy.deepcopy make an independent one; save what it is made of, such as a"
        " scene file"
    )
    _query_type: ClassVar[Callable[[Context], Any] | None] = None

    def __init__(
        self,
        config: SceneGraphConfig | None = None,
        *,
        accuracy: Accuracy | str = Accuracy.EXACT,
        engine: Engine | str = Engine.NATIVE,
    ) -> None:
        """Make an empty model with the defaults of its queries.

        Args:
            config: values of contact for geometry that has none of its own; by default none.
            accuracy: "quick", "standard" or "exact": the error of a distance is at most
                ``Accuracy(accuracy).bound`` (1e-3, 1e-6, 1e-12) of the pair's larger shape.
            engine: "native", or "fcl" to compare with python-fcl, which promises no bound.

        Raises:
            QueryArgumentError: there is no such tier or engine.
            EngineError: the engine is not installed.
            PropertyValueError: ``config`` is no SceneGraphConfig.

        """
        state = GeometryState()
        state.config = checked_config(config)
        state.accuracy, state.engine = as_accuracy(accuracy), as_engine(engine)
        self._model = ModelOwner(state)

    @classmethod
    def provide_queries(cls, query_type: Callable[[Context], Any]) -> None:
        """Set the factory of query_object; the query layer, which is above this one, calls it."""
        cls._query_type = query_type

    def __repr__(self) -> str:
        return f"SceneGraph({self._model.state.summary()})"

    def _repr_html_(self) -> Any:
        query: Any = self.query_object(self.create_default_context())
        return query._repr_html_()

    def _owner(self, context: Context | None) -> ModelOwner:
        if context is None:
            return self._model
        if not isinstance(context, Context):
            raise TypeError(f"context must come from create_default_context(), not {context!r}")
        return context

    def all_or_nothing(
        self, changes: Callable[[], Result], *, context: Context | None = None
    ) -> Result:
        """Call a function that makes several changes, and return its answer.

        Where it raises, or is interrupted, none of them is made; poses stay as they became.
        Other threads' changes of the same model wait. It takes a copy of the model's tables.
        Raises QueryArgumentError for an object that can't be called.
        """
        return self._owner(context).all_or_nothing(changes)

    # Contexts, queries, inspection.

    def create_default_context(self) -> Context:
        """Return a context with a copy of the model, every frame at the identity in its parent."""
        return Context(self._model.share())

    def clone(self) -> SceneGraph:
        """Return an independent scene graph with the same model, ids included.

        It costs next to nothing: the model is shared until either of the two changes.
        """
        result = SceneGraph()
        result._model = ModelOwner(self._model.share())
        return result

    def __deepcopy__(self, memo: dict[int, Any]) -> SceneGraph:
        return self.clone()

    def query_object(self, context: Context) -> QueryObject:
        """Return a live query object: it sees later changes of the context, until baked."""
        if context is None:
            raise TypeError("query_object needs a context: create_default_context() makes one")
        self._owner(context)
        make = type(self)._query_type
        if make is None:
            raise TypeError(
                "no queries were provided: import scene_graph_ros.geometry, which provides them"
            )
        result: QueryObject = make(context)
        return result

    def model_inspector(self) -> SceneGraphInspector:
        """Return an inspector of the scene graph's own model, which follows its changes."""
        return SceneGraphInspector(self._model)

    def collision_filter_manager(self, context: Context | None = None) -> CollisionFilterManager:
        """Return the manager that applies filter declarations to the model, or the context's."""
        return CollisionFilterManager(self._owner(context))

    def exclude_collisions_within(
        self, geometry_set: GeometrySet, *, context: Context | None = None
    ) -> None:
        """Exclude all pairs within a set, for good; see CollisionFilterManager.apply."""
        declaration = CollisionFilterDeclaration().exclude_within(geometry_set)
        self.collision_filter_manager(context).apply(declaration)

    def exclude_collisions_between(
        self, set_A: GeometrySet, set_B: GeometrySet, *, context: Context | None = None
    ) -> None:
        """Exclude all pairs with one geometry in each set; see CollisionFilterManager.apply."""
        declaration = CollisionFilterDeclaration().exclude_between(set_A, set_B)
        self.collision_filter_manager(context).apply(declaration)

    @staticmethod
    def world_frame_id() -> FrameId:
        """Return the id of the world frame, the same in every scene graph."""
        return WORLD_FRAME_ID

    def source_is_registered(self, source_id: SourceId, *, context: Context | None = None) -> bool:
        """Tell whether there is a source with this id."""
        return SceneGraphInspector(self._owner(context)).source_is_registered(source_id)

    # Registration.

    def register_source(self, name: str = "", *, context: Context | None = None) -> SourceId:
        """Add a source; its id is the token for all it does later.

        Without a name one is made up. Raises NameConflictError if the name is taken or blank.
        """
        return self._owner(context).change(registration.add_source, name)

    def register_frame(
        self,
        source_id: SourceId,
        frame: GeometryFrame,
        *,
        parent: FrameId | None = None,
        context: Context | None = None,
    ) -> FrameId:
        """Add a frame below ``parent``, a frame of the same source, or below the world.

        Returns the frame's id. Raises NameConflictError if the source has a frame with that name,
        or the frame is registered already.
        """
        parent_id = WORLD_FRAME_ID if parent is None else parent
        return self._owner(context).change(registration.add_frame, source_id, frame, parent_id)

    def register_geometry(
        self,
        source_id: SourceId,
        parent: FrameId | GeometryId,
        geometry: GeometryInstance,
        *,
        context: Context | None = None,
    ) -> GeometryId:
        """Add a geometry on a frame, or on another geometry whose frame it then shares.

        It gets the roles its instance has properties for. Returns the geometry's id. Raises
        NameConflictError if its name is taken on that frame for one of the roles or the instance
        is registered already, and MeshError or PropertyError if it cannot get the proximity or
        the perception role.
        """
        owner = self._owner(context)
        registration.check_instance(geometry)
        shape, name = geometry.shape(), geometry.name()
        properties = geometry.proximity_properties()
        if properties is not None:
            read_mesh_data(shape, properties, name)
        read_looks(shape, geometry.properties, name)
        return owner.change(registration.add_geometry, source_id, parent, geometry)

    def register_anchored_geometry(
        self, source_id: SourceId, geometry: GeometryInstance, *, context: Context | None = None
    ) -> GeometryId:
        """Add a geometry on the world, where it never moves: ``X_PG`` is ``X_WG``."""
        return self.register_geometry(source_id, WORLD_FRAME_ID, geometry, context=context)

    def register_deformable_geometry(
        self,
        source_id: SourceId,
        frame_id: FrameId,
        geometry: GeometryInstance,
        resolution_hint: float | None = None,
        *,
        reference_mesh: VolumeMesh | None = None,
        context: Context | None = None,
    ) -> GeometryId:
        """Add a geometry whose vertices move one by one; ``frame_id`` must be the world.

        Its reference mesh is the shape cut into tetrahedra with edges of about
        ``resolution_hint`` (m), up to twice as long on flat sides and inside; a ``Mesh`` of a file
        of tetrahedra (``.vtk``, ``.vtu``) as it is there; or ``reference_mesh``, the shape being
        only a description. The instance's pose is that of the mesh in the world until a context
        sets a configuration.

        Roles come with the instance or later. Each role has a driven mesh: the boundary, or the
        mesh that its property ``("deformable", "embedded_mesh")`` gives, a path or a ``Mesh``.

        Returns the geometry's id. Raises DeformableError for another frame than the world, a half
        space, or a bad hint or reference mesh; PropertyError for a curved shape without a hint;
        MeshError if there is no volume mesh of the shape or a mesh to embed cannot be read; else
        as register_geometry does.
        """
        owner = self._owner(context)
        registration.check_instance(geometry)
        registration.check_deformable_frame(owner.state, source_id, frame_id)
        made = make_deformable(geometry, resolution_hint, reference_mesh)
        read_looks(geometry.shape(), geometry.properties, geometry.name(), deforms=True)
        read_embedded_meshes(geometry.properties(role) for role in ROLES)
        return owner.change(registration.add_geometry, source_id, frame_id, geometry, made)

    # Roles.

    def assign_role(
        self,
        source_id: SourceId,
        geometry_id: GeometryId,
        properties: GeometryProperties,
        assign: RoleAssign = RoleAssign.NEW,
        *,
        context: Context | None = None,
    ) -> None:
        """Give a geometry the role that the type of the properties stands for.

        Raises RoleError if it has the role already (NEW) or not yet (REPLACE), NameConflictError
        if another geometry on its frame has that role and its name, and MeshError or PropertyError
        if it cannot get the proximity or the perception role. The properties are copied.
        """
        owner = self._owner(context)
        owner.state.require_source(source_id)
        read_for_role(owner.state.geometry(geometry_id), properties)
        owner.change(alteration.assign_role, source_id, geometry_id, properties, assign)

    def remove_role(
        self,
        source_id: SourceId,
        target: FrameId | GeometryId,
        role: Role,
        *,
        context: Context | None = None,
    ) -> int:
        """Take a role from a geometry, or from all the source's geometries on a frame.

        Returns how many had it. Collision filters about them are forgotten with the
        proximity role.
        """
        return self._owner(context).change(removal.remove_role, source_id, target, role)

    # Removal.

    def remove_geometry(
        self, source_id: SourceId, geometry_id: GeometryId, *, context: Context | None = None
    ) -> None:
        """Remove a geometry, and the geometries that hang on it."""
        self._owner(context).change(removal.remove_geometry, source_id, geometry_id)

    def remove_frame(
        self, source_id: SourceId, frame_id: FrameId, *, context: Context | None = None
    ) -> None:
        """Remove a frame, the frames below it and all their geometries."""
        self._owner(context).change(removal.remove_frame, source_id, frame_id)

    def remove_source(self, source_id: SourceId, *, context: Context | None = None) -> None:
        """Remove a source with all its frames and geometries."""
        self._owner(context).change(removal.remove_source, source_id)

    # Alteration.

    def change_shape(
        self,
        source_id: SourceId,
        geometry_id: GeometryId,
        shape: Shape,
        X_FG: Any | None = None,
        *,
        context: Context | None = None,
    ) -> None:
        """Replace a geometry's shape, and its pose ``(4, 4)`` in its frame if one is given.

        Geometries that hang on it move along. Roles and filters stay.
        """
        owner = self._owner(context)
        owner.state.require_source(source_id)
        record = owner.state.geometry(geometry_id)
        if record.deformable is None and Role.PROXIMITY in record.properties:
            properties = record.properties[Role.PROXIMITY]
            read_mesh_data(checked_shape(shape, record.name), properties, record.name)
        if record.deformable is None:
            read_looks(checked_shape(shape, record.name), record.properties.get, record.name)
        owner.change(alteration.change_shape, source_id, geometry_id, shape, X_FG)

    def change_parent(
        self,
        source_id: SourceId,
        frame_id: FrameId,
        parent_id: FrameId,
        *,
        context: Context | None = None,
    ) -> None:
        """Have a frame hang on another one, also of another source, with all that is below it.

        So a gripper's link carries a grasped object. Its pose ``X_PF`` is by now in the new
        parent, with the same numbers: set it. It is removed with its parent. Raises OwnershipError
        unless the frame is the source's, UnknownIdError for an unknown frame, NameConflictError
        for a parent that is below it.
        """
        self._owner(context).change(alteration.change_parent, source_id, frame_id, parent_id)

    def rename_frame(
        self, source_id: SourceId, frame_id: FrameId, name: str, *, context: Context | None = None
    ) -> None:
        """Rename a frame. Raises NameConflictError if its source has one of that name."""
        self._owner(context).change(alteration.rename_frame, source_id, frame_id, name)

    def rename_geometry(
        self,
        source_id: SourceId,
        geometry_id: GeometryId,
        name: str,
        *,
        context: Context | None = None,
    ) -> None:
        """Rename a geometry. Raises NameConflictError if one of its roles has that name."""
        self._owner(context).change(alteration.rename_geometry, source_id, geometry_id, name)
