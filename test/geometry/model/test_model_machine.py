"""Random changes of a model and a context against a plain reference, and their isolation."""

import dataclasses

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, precondition, rule, RuleBasedStateMachine
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    GeometryFrame,
    GeometryInstance,
    IllustrationProperties,
    ProximityProperties,
    Role,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import NameConflictError

INDEX = st.integers(0, 30)
NAMES = st.sampled_from(["a", " a", "b", "c\t"])
ROLE_PROPERTIES = {
    Role.PROXIMITY: ProximityProperties,
    Role.ILLUSTRATION: IllustrationProperties,
}
WORLD = SceneGraph.world_frame_id()


@dataclasses.dataclass
class Geometry:
    """What the reference knows about a geometry."""

    source: object
    frame: object
    parent: object
    name: str
    position: float
    shape: object
    roles: set


class Reference:
    """A scene as plain dicts: the meaning of every operation in a line or two."""

    def __init__(self):
        self.frames = {}  # frame id -> [source, parent, position]
        self.geometries = {}

    def copy(self):
        """Return an independent reference."""
        result = Reference()
        result.frames = {i: list(f) for i, f in self.frames.items()}
        result.geometries = {
            i: dataclasses.replace(g, roles=set(g.roles)) for i, g in self.geometries.items()
        }
        return result

    def remove_geometry(self, geometry_id):
        """Remove a geometry and what hangs on it."""
        del self.geometries[geometry_id]
        for child in [i for i, g in self.geometries.items() if g.parent == geometry_id]:
            self.remove_geometry(child)

    def remove_frame(self, frame_id):
        """Remove a frame, its geometry and the frames below."""
        del self.frames[frame_id]
        self.geometries = {i: g for i, g in self.geometries.items() if g.frame != frame_id}
        for child in [i for i, f in self.frames.items() if f[1] == frame_id]:
            self.remove_frame(child)

    def name_is_taken(self, frame, role, name, but=None):
        """Tell whether another geometry has this frame, role and name."""
        return any(
            g.frame == frame and g.name == name and role in g.roles and i != but
            for i, g in self.geometries.items()
        )

    def world_x(self, geometry_id):
        """Return the position of a geometry along x: all poses are translations."""
        g = self.geometries[geometry_id]
        x = g.position
        while g.parent in self.geometries:
            g = self.geometries[g.parent]
            x += g.position
        return x + self.frame_x(g.frame)

    def frame_x(self, frame_id):
        """Return the position of a frame along x."""
        x = 0.0
        while frame_id != WORLD:
            _, parent, position = self.frames[frame_id]
            x, frame_id = x + position, parent
        return x


def along_x(x):
    """Return a translation along x."""
    X = np.eye(4)
    X[0, 3] = x
    return X


class ModelMachine(RuleBasedStateMachine):
    """The same rules act on the scene graph's model or on a context's."""

    @initialize()
    def start(self):
        """Make a scene with two sources, and a context."""
        self.graph = SceneGraph()
        self.sources = [self.graph.register_source(name) for name in ("s", "t")]
        self.model = Reference()
        self.context = self.graph.create_default_context()
        self.in_context = Reference()
        self.kept = []  # (snapshot, reference at that time)
        self.count = 0

    def pick(self, in_context):
        """Return the arguments and the reference of the model to act on."""
        if in_context:
            return {"context": self.context}, self.in_context
        return {}, self.model

    @rule(in_context=st.booleans(), source=st.integers(0, 1), parent=INDEX)
    def register_frame(self, in_context, source, parent):
        """Add a frame below the world or a frame of its source."""
        arguments, reference = self.pick(in_context)
        source = self.sources[source]
        parents = [WORLD, *[i for i, f in reference.frames.items() if f[0] == source]]
        parent = parents[parent % len(parents)]
        self.count += 1
        frame = GeometryFrame(f"f{self.count}")
        frame_id = self.graph.register_frame(source, frame, parent=parent, **arguments)
        reference.frames[frame_id] = [source, parent, 0.0]

    @rule(in_context=st.booleans(), source=st.integers(0, 1), parent=INDEX, name=NAMES)
    def register_geometry(self, in_context, source, parent, name):
        """Add a geometry on the world, a frame or a geometry of its source."""
        arguments, reference = self.pick(in_context)
        source = self.sources[source]
        parents = [WORLD, *[i for i, f in reference.frames.items() if f[0] == source]]
        parents += [i for i, g in reference.geometries.items() if g.source == source]
        parent = parents[parent % len(parents)]
        self.count += 1
        x = float(self.count)
        instance = GeometryInstance(along_x(x), Sphere(x), name)
        geometry_id = self.graph.register_geometry(source, parent, instance, **arguments)
        on = reference.geometries.get(parent)
        frame = parent if on is None else on.frame
        reference.geometries[geometry_id] = Geometry(
            source, frame, parent, name.strip(), x, Sphere(x), set()
        )

    @rule(in_context=st.booleans(), index=INDEX, role=st.sampled_from(list(ROLE_PROPERTIES)))
    def toggle_role(self, in_context, index, role):
        """Give or take a role; a taken name is refused."""
        arguments, reference = self.pick(in_context)
        if not reference.geometries:
            return
        geometry_id = list(reference.geometries)[index % len(reference.geometries)]
        geometry = reference.geometries[geometry_id]
        if role in geometry.roles:
            assert self.graph.remove_role(geometry.source, geometry_id, role, **arguments) == 1
            geometry.roles.remove(role)
            return
        properties = ROLE_PROPERTIES[role]()
        if reference.name_is_taken(geometry.frame, role, geometry.name):
            with pytest.raises(NameConflictError):
                self.graph.assign_role(geometry.source, geometry_id, properties, **arguments)
            return
        self.graph.assign_role(geometry.source, geometry_id, properties, **arguments)
        geometry.roles.add(role)

    @rule(in_context=st.booleans(), index=INDEX, name=NAMES)
    def rename(self, in_context, index, name):
        """Rename a geometry; a name taken for one of its roles is refused."""
        arguments, reference = self.pick(in_context)
        if not reference.geometries:
            return
        geometry_id = list(reference.geometries)[index % len(reference.geometries)]
        geometry, label = reference.geometries[geometry_id], name.strip()
        taken = any(
            reference.name_is_taken(geometry.frame, role, label, but=geometry_id)
            for role in geometry.roles
        )
        if taken:
            with pytest.raises(NameConflictError):
                self.graph.rename_geometry(geometry.source, geometry_id, name, **arguments)
            return
        self.graph.rename_geometry(geometry.source, geometry_id, name, **arguments)
        geometry.name = label

    @rule(in_context=st.booleans(), index=INDEX)
    def change_shape(self, in_context, index):
        """Give a geometry another shape."""
        arguments, reference = self.pick(in_context)
        if not reference.geometries:
            return
        geometry_id = list(reference.geometries)[index % len(reference.geometries)]
        geometry = reference.geometries[geometry_id]
        self.count += 1
        geometry.shape = Box.make_cube(float(self.count))
        self.graph.change_shape(geometry.source, geometry_id, geometry.shape, **arguments)

    @rule(in_context=st.booleans(), index=INDEX)
    def remove_geometry(self, in_context, index):
        """Remove a geometry with what hangs on it."""
        arguments, reference = self.pick(in_context)
        if not reference.geometries:
            return
        geometry_id = list(reference.geometries)[index % len(reference.geometries)]
        source = reference.geometries[geometry_id].source
        self.graph.remove_geometry(source, geometry_id, **arguments)
        reference.remove_geometry(geometry_id)

    @rule(in_context=st.booleans(), index=INDEX)
    def remove_frame(self, in_context, index):
        """Remove a frame with what is below."""
        arguments, reference = self.pick(in_context)
        if not reference.frames:
            return
        frame_id = list(reference.frames)[index % len(reference.frames)]
        self.graph.remove_frame(reference.frames[frame_id][0], frame_id, **arguments)
        reference.remove_frame(frame_id)

    @rule(index=INDEX, x=st.integers(-9, 9))
    def move(self, index, x):
        """Move a frame of the context."""
        if not self.in_context.frames:
            return
        frame_id = list(self.in_context.frames)[index % len(self.in_context.frames)]
        frame = self.in_context.frames[frame_id]
        self.context.set_frame_pose(frame[0], frame_id, along_x(float(x)))
        frame[2] = float(x)

    @rule(source=st.integers(0, 1), x=st.integers(-9, 9))
    def move_all(self, source, x):
        """Move all frames of a source at once, in the order of registration."""
        source = self.sources[source]
        own = [i for i, f in self.in_context.frames.items() if f[0] == source]
        positions = [float(x + k) for k in range(len(own))]
        X_PFs = np.array([along_x(p) for p in positions]).reshape(-1, 4, 4)
        self.context.set_frame_poses(source, X_PFs)
        for frame_id, position in zip(own, positions, strict=True):
            self.in_context.frames[frame_id][2] = position

    @precondition(lambda self: len(self.kept) < 4)
    @rule()
    def keep_snapshot(self):
        """Keep a snapshot, which must not change from now on."""
        self.kept.append((self.context.snapshot, self.in_context.copy()))

    @rule()
    def new_context(self):
        """Replace the context by a new one of the model, with all frames at the identity."""
        self.context = self.graph.create_default_context()
        self.in_context = self.model.copy()
        for frame in self.in_context.frames.values():
            frame[2] = 0.0

    @staticmethod
    def check(inspector, reference):
        """Compare all that an inspector says with a reference."""
        assert set(inspector.get_all_frame_ids()) == {WORLD, *reference.frames}
        assert inspector.get_all_geometry_ids() == list(reference.geometries)
        for frame_id, (source, parent, _) in reference.frames.items():
            assert inspector.get_parent_frame(frame_id) == parent
            assert inspector.get_owning_source_id(frame_id) == source
            assert inspector.get_frame_id_by_name(source, inspector.get_name(frame_id)) == frame_id
        for frame_id in (WORLD, *reference.frames):
            children = [i for i, f in reference.frames.items() if f[1] == frame_id]
            assert inspector.get_child_frames(frame_id) == children
            on_frame = {i for i, g in reference.geometries.items() if g.frame == frame_id}
            assert set(inspector.get_geometries(frame_id)) == on_frame
        for geometry_id, g in reference.geometries.items():
            assert inspector.get_frame_id(geometry_id) == g.frame
            assert (inspector.get_parent_geometry(geometry_id) or g.frame) == g.parent
            assert inspector.get_name(geometry_id) == g.name
            assert inspector.get_shape(geometry_id) == g.shape
            assert inspector.get_roles(geometry_id) == g.roles
            assert inspector.get_pose_in_parent(geometry_id)[0, 3] == g.position
            for role in g.roles:
                assert inspector.get_geometry_id_by_name(g.frame, role, g.name) == geometry_id
        for role in ROLE_PROPERTIES:
            having = [i for i, g in reference.geometries.items() if role in g.roles]
            assert inspector.get_all_geometry_ids(role) == having
        order = {i: k for k, i in enumerate(inspector.get_all_frame_ids())}
        assert all(order[f[1]] < order[i] for i, f in reference.frames.items())

    def check_snapshot(self, snapshot, reference):
        """Compare a snapshot's model, poses and arrays with a reference."""
        self.check(snapshot.inspector, reference)
        for geometry_id in reference.geometries:
            assert snapshot.pose_in_world(geometry_id)[0, 3] == reference.world_x(geometry_id)
        for role in ROLE_PROPERTIES:
            rows = snapshot.role_arrays(role)
            having = sorted(i for i, g in reference.geometries.items() if role in g.roles)
            assert list(rows.geometry_ids) == having
            expected = [reference.world_x(i) for i in having]
            assert snapshot.X_WG_of(role)[:, 0, 3].tolist() == expected
        table = snapshot.proximity.table
        assert len(table.kind) == len(snapshot.proximity.ids)

    @invariant()
    def everything_agrees(self):
        """The model, the context and every kept snapshot are what the reference says."""
        if not hasattr(self, "graph"):
            return
        self.check(self.graph.model_inspector(), self.model)
        self.check(self.context.inspector(), self.in_context)
        for snapshot, reference in self.kept:
            self.check_snapshot(snapshot, reference)

    def teardown(self):
        """Compare the last moment too."""
        if hasattr(self, "graph"):
            self.check_snapshot(self.context.snapshot, self.in_context)


TestModelMachine = ModelMachine.TestCase
TestModelMachine.__doc__ = (
    "Model, context and snapshots agree with the reference after any changes."
)
TestModelMachine.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
