"""Random sequences of declarations against a reference that knows pairs only."""

import itertools

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, precondition, rule, RuleBasedStateMachine
import numpy as np

from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    ProximityProperties,
    Role,
    SceneGraph,
    Sphere,
)

FRAMES = 4
MEMBERS = st.sets(st.integers(0, 20), max_size=4)
STATEMENTS = st.lists(
    st.tuples(st.sampled_from(["exclude", "allow"]), MEMBERS, st.none() | MEMBERS),
    min_size=1,
    max_size=3,
)


def pairs_of(ids_A, ids_B):
    """Return the unordered pairs with one id in each set."""
    return {frozenset((a, b)) for a in ids_A for b in ids_B if a != b}


class FilterMachine(RuleBasedStateMachine):
    """Frame 0 is the world. The reference keeps excluded pairs in sets, and a history."""

    @initialize()
    def start(self):
        """Make a scene of four frames, and pick a context of it to work in."""
        self.graph = SceneGraph()
        self.source = self.graph.register_source("s")
        self.frames = [self.graph.world_frame_id()]
        for i in range(1, FRAMES):
            self.frames.append(self.graph.register_frame(self.source, GeometryFrame(f"f{i}")))
        self.context = self.graph.create_default_context()
        self.manager = self.graph.collision_filter_manager(self.context)
        self.frame_of = {}  # geometry id -> index of its frame
        self.with_role = set()
        self.excluded = set()  # by persistent declarations
        self.history = []  # (filter id, [(operation, pairs)])
        self.registered = 0

    def resolve(self, members):
        """Return a set, and the geometries with the role that it means now.

        Members below FRAMES are frames, others geometries.
        """
        geometries = sorted(self.frame_of)
        geometry_set, meant = GeometrySet(), set()
        for member in members:
            if member < FRAMES:
                geometry_set.add(self.frames[member])
                meant |= {g for g, f in self.frame_of.items() if f == member}
            elif geometries:
                chosen = geometries[member % len(geometries)]
                geometry_set.add(chosen)
                meant.add(chosen)
        return geometry_set, meant & self.with_role

    def declare(self, statements):
        """Return a declaration and its meaning."""
        declaration, meaning = CollisionFilterDeclaration(), []
        for operation, members_A, members_B in statements:
            set_A, ids_A = self.resolve(members_A)
            if members_B is None:
                getattr(declaration, f"{operation}_within")(set_A)
                meaning.append((operation, pairs_of(ids_A, ids_A)))
            else:
                set_B, ids_B = self.resolve(members_B)
                getattr(declaration, f"{operation}_between")(set_A, set_B)
                meaning.append((operation, pairs_of(ids_A, ids_B)))
        return declaration, meaning

    @rule(frame=st.integers(0, FRAMES - 1), has_role=st.booleans())
    def register(self, frame, has_role):
        """Add a geometry, with or without the role."""
        instance = GeometryInstance(np.eye(4), Sphere(0.1), f"g{self.registered}")
        self.registered += 1
        if has_role:
            instance.set_proximity_properties(ProximityProperties())
        geometry_id = self.graph.register_geometry(
            self.source, self.frames[frame], instance, context=self.context
        )
        self.frame_of[geometry_id] = frame
        if has_role:
            self.with_role.add(geometry_id)

    @precondition(lambda self: self.frame_of)
    @rule(index=st.integers(0, 20))
    def toggle_role(self, index):
        """Take the role, which forgets what was declared, or give it."""
        geometry_id = sorted(self.frame_of)[index % len(self.frame_of)]
        if geometry_id in self.with_role:
            self.graph.remove_role(self.source, geometry_id, Role.PROXIMITY, context=self.context)
            self.with_role.remove(geometry_id)
            self.forget(geometry_id)
        else:
            self.graph.assign_role(
                self.source, geometry_id, ProximityProperties(), context=self.context
            )
            self.with_role.add(geometry_id)

    @precondition(lambda self: self.frame_of)
    @rule(index=st.integers(0, 20))
    def remove(self, index):
        """Remove a geometry."""
        geometry_id = sorted(self.frame_of)[index % len(self.frame_of)]
        self.graph.remove_geometry(self.source, geometry_id, context=self.context)
        del self.frame_of[geometry_id]
        self.with_role.discard(geometry_id)
        self.forget(geometry_id)

    def forget(self, geometry_id):
        """Drop the pairs of a geometry from all that was declared."""
        self.excluded = {pair for pair in self.excluded if geometry_id not in pair}
        self.history = [
            (i, [(op, {p for p in pairs if geometry_id not in p}) for op, pairs in meaning])
            for i, meaning in self.history
        ]

    @precondition(lambda self: not self.history)
    @rule(statements=STATEMENTS)
    def apply(self, statements):
        """Declare for good."""
        declaration, meaning = self.declare(statements)
        self.manager.apply(declaration)
        for operation, pairs in meaning:
            self.excluded = (
                self.excluded | pairs if operation == "exclude" else self.excluded - pairs
            )

    @rule(statements=STATEMENTS)
    def apply_transient(self, statements):
        """Declare for a while."""
        declaration, meaning = self.declare(statements)
        self.history.append((self.manager.apply_transient(declaration), meaning))

    @precondition(lambda self: self.history)
    @rule(index=st.integers(0, 20))
    def remove_declaration(self, index):
        """Take any transient declaration back."""
        filter_id, _ = self.history.pop(index % len(self.history))
        assert self.manager.remove_declaration(filter_id)

    @rule()
    def query(self):
        """Build a snapshot, after which the next change works on a copy of the model."""
        self.context.snapshot.proximity  # noqa: B018  # computed for its side effect

    @invariant()
    def pairs_agree(self):
        """Candidates are the reference's pairs, from the inspector and from the bits."""
        if not hasattr(self, "graph"):
            return
        excluded = set(self.excluded)
        for _, meaning in self.history:
            for operation, pairs in meaning:
                excluded = excluded | pairs if operation == "exclude" else excluded - pairs
        expected = [
            (a, b)
            for a, b in itertools.combinations(sorted(self.with_role), 2)
            if self.frame_of[a] != self.frame_of[b] and frozenset((a, b)) not in excluded
        ]
        assert self.context.inspector().get_collision_candidates() == expected
        state = self.context.state
        ids = sorted(self.with_role)
        bits = state.filters.bit_matrix(ids)
        if bits is None:
            assert not excluded
            return
        unpacked = np.unpackbits(bits, axis=1, count=len(ids), bitorder="little")
        for i, j in itertools.permutations(range(len(ids)), 2):
            assert unpacked[i, j] == (frozenset((ids[i], ids[j])) in excluded)

    @invariant()
    def history_agrees(self):
        """Transient declarations are active until they are removed; the model has none."""
        if not hasattr(self, "graph"):
            return
        assert self.manager.has_transient_history() == bool(self.history)
        assert all(self.manager.is_active(filter_id) for filter_id, _ in self.history)
        assert self.graph.model_inspector().num_geometries() == 0


TestFilterMachine = FilterMachine.TestCase
TestFilterMachine.__doc__ = "Filters agree with the reference after any sequence of changes."
TestFilterMachine.settings = settings(max_examples=60, stateful_step_count=25, deadline=None)
