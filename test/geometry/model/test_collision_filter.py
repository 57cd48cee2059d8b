"""Collision filter declarations: their meaning, their order, and what they do not affect."""

import itertools

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    CollisionFilterScope,
    FilterId,
    FrameId,
    GeometryFrame,
    GeometryId,
    GeometrySet,
    ProximityProperties,
    Role,
    RoleAssign,
    SceneGraph,
)
from scene_graph_ros.geometry.errors import FilterHistoryError, UnknownIdError


@pytest.fixture(name="row")
def _row(world):
    """Five balls on frames of their own, in a scene of their own."""
    graph = SceneGraph()
    source = graph.register_source("s")
    frames = [graph.register_frame(source, GeometryFrame(f"f{i}")) for i in range(5)]
    balls = [
        graph.register_geometry(source, frame, world.instance("g", proximity=True))
        for frame in frames
    ]
    return graph, source, frames, balls


def allowed(graph, balls, context=None):
    """Return the index pairs that are not filtered."""
    inspector = graph.model_inspector() if context is None else context.inspector()
    return {
        (i, j)
        for i, j in itertools.combinations(range(len(balls)), 2)
        if not inspector.collision_filtered(balls[i], balls[j])
    }


ALL_PAIRS = set(itertools.combinations(range(5), 2))


def declare():
    """Return an empty declaration."""
    return CollisionFilterDeclaration()


def test_nothing_is_filtered_at_first(row):
    """Geometries on different moving frames may collide."""
    graph, _, _, balls = row
    assert allowed(graph, balls) == ALL_PAIRS
    assert graph.create_default_context().snapshot.proximity.filter_bits is None


def test_exclude_within(row):
    """All pairs within the set go, those with others stay."""
    graph, _, _, balls = row
    graph.collision_filter_manager().apply(declare().exclude_within(GeometrySet(balls[:3])))
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1), (0, 2), (1, 2)}


def test_exclude_between(row):
    """Pairs across the sets go, pairs within each set stay."""
    graph, _, frames, balls = row
    graph.collision_filter_manager().apply(
        declare().exclude_between(GeometrySet(frames[:2]), GeometrySet(balls[2], frames[3]))
    )
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 2), (0, 3), (1, 2), (1, 3)}


def test_allow_undoes_exclusions(row):
    """Later statements overrule earlier ones, within one declaration and across."""
    graph, _, _, balls = row
    manager = graph.collision_filter_manager()
    manager.apply(
        declare()
        .exclude_within(GeometrySet(balls))
        .allow_between(GeometrySet(balls[0]), GeometrySet(balls[1:3]))
    )
    assert allowed(graph, balls) == {(0, 1), (0, 2)}
    manager.apply(declare().allow_within(GeometrySet(balls[2:])))
    assert allowed(graph, balls) == {(0, 1), (0, 2), (2, 3), (2, 4), (3, 4)}
    manager.apply(declare().exclude_between(GeometrySet(balls[0]), GeometrySet(balls)))
    assert allowed(graph, balls) == {(2, 3), (2, 4), (3, 4)}


def test_pairs_that_never_collide_cannot_be_allowed(world):
    """Geometries of one frame and anchored ones stay filtered, whatever is declared."""
    graph = world.scene_graph
    twin = graph.register_geometry(world.arm, world.link1, world.instance("t", proximity=True))
    wall = graph.register_anchored_geometry(world.other, world.instance("w", proximity=True))
    everything = GeometrySet(world.inspector.get_all_geometry_ids())
    graph.collision_filter_manager().apply(declare().allow_within(everything))
    assert world.inspector.collision_filtered(world.ball1, twin)
    assert world.inspector.collision_filtered(world.floor, wall)
    assert not world.inspector.collision_filtered(world.ball1, wall)


def test_frames_are_looked_up_when_applied(row, world):
    """Geometry added to a frame after the declaration was made, but before it was applied."""
    graph, source, frames, balls = row
    declaration = declare().exclude_between(GeometrySet(frames[0]), GeometrySet(frames[1]))
    late = graph.register_geometry(source, frames[0], world.instance("late", proximity=True))
    graph.collision_filter_manager().apply(declaration)
    assert graph.model_inspector().collision_filtered(late, balls[1])


def test_sets_are_copied_when_declared(row):
    """Adding to a set afterwards does not change a declaration."""
    graph, _, _, balls = row
    geometry_set = GeometrySet(balls[:2])
    declaration = declare().exclude_within(geometry_set)
    geometry_set.add(balls[2])
    graph.collision_filter_manager().apply(declaration)
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1)}


def test_later_geometry_is_not_affected(row, world):
    """What is registered, or gets the role, after the declaration may collide."""
    graph, source, frames, balls = row
    ghost = graph.register_geometry(source, frames[1], world.instance("ghost"))
    manager = graph.collision_filter_manager()
    declaration = declare().exclude_within(GeometrySet(frames))
    manager.apply(declaration)
    late = graph.register_geometry(source, frames[0], world.instance("late", proximity=True))
    graph.assign_role(source, ghost, ProximityProperties())
    assert not graph.model_inspector().collision_filtered(late, balls[1])
    assert not graph.model_inspector().collision_filtered(ghost, balls[0])
    assert not graph.model_inspector().collision_filtered(ghost, late)
    manager.apply(declaration)
    assert graph.model_inspector().collision_filtered(ghost, late)


def test_replacing_the_role_keeps_filters_and_removing_forgets_them(row):
    """New properties change nothing; the role taken and given again starts afresh."""
    graph, source, _, balls = row
    graph.collision_filter_manager().apply(declare().exclude_within(GeometrySet(balls)))
    graph.assign_role(source, balls[0], ProximityProperties(), RoleAssign.REPLACE)
    assert allowed(graph, balls) == set()
    graph.remove_role(source, balls[0], Role.PROXIMITY)
    graph.assign_role(source, balls[0], ProximityProperties())
    assert allowed(graph, balls) == {(0, 1), (0, 2), (0, 3), (0, 4)}


@pytest.mark.parametrize("unknown", [GeometryId.get_new_id(), FrameId.get_new_id()])
@pytest.mark.parametrize("method", ["apply", "apply_transient"])
def test_unknown_ids_change_nothing(row, unknown, method):
    """One unknown id refuses the whole declaration."""
    graph, _, _, balls = row
    declaration = declare().exclude_within(GeometrySet(balls))
    declaration.exclude_within(GeometrySet(balls[0], unknown))
    with pytest.raises(
        UnknownIdError, match=repr(unknown).replace("(", r"\(").replace(")", r"\)")
    ):
        getattr(graph.collision_filter_manager(), method)(declaration)
    assert allowed(graph, balls) == ALL_PAIRS


def test_only_geometry_sets_are_operands():
    """A list of ids is refused where a set is expected."""
    with pytest.raises(TypeError, match="exclude takes a GeometrySet"):
        declare().exclude_within([GeometryId(3)])
    with pytest.raises(TypeError, match="allow takes a GeometrySet"):
        declare().allow_between(GeometrySet(), [GeometryId(3)])


@pytest.mark.parametrize("method", ["apply", "apply_transient"])
def test_only_declarations_are_applied(row, method):
    """A set alone says nothing about what is to happen to it."""
    graph, _, _, balls = row
    with pytest.raises(TypeError, match="CollisionFilterDeclaration, not GeometrySet"):
        getattr(graph.collision_filter_manager(), method)(GeometrySet(balls))


def test_scope_is_one_of_the_scopes():
    """The name of a scope is none."""
    with pytest.raises(TypeError, match="CollisionFilterScope, not 'all'"):
        CollisionFilterDeclaration("all")


def test_short_forms_exclude_for_good(row):
    """The two methods of the scene graph do what the declarations of the same names do."""
    graph, _, frames, balls = row
    context = graph.create_default_context()
    graph.exclude_collisions_within(GeometrySet(frames[:2]))
    graph.exclude_collisions_between(GeometrySet(balls[2]), GeometrySet(balls[3:]))
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1), (2, 3), (2, 4)}
    assert allowed(graph, balls, context) == ALL_PAIRS
    graph.exclude_collisions_within(GeometrySet(balls), context=context)
    graph.exclude_collisions_between(GeometrySet(), GeometrySet(balls), context=context)
    assert allowed(graph, balls, context) == set()
    assert not graph.collision_filter_manager().has_transient_history()


def test_transient_declarations_come_and_go_in_any_order(row):
    """Removing one leaves the others as if it had never been."""
    graph, _, _, balls = row
    manager = graph.collision_filter_manager()
    manager.apply(declare().exclude_within(GeometrySet(balls[:2])))
    a = manager.apply_transient(declare().exclude_within(GeometrySet(balls)))
    b = manager.apply_transient(declare().allow_within(GeometrySet(balls[:3])))
    c = manager.apply_transient(declare().exclude_within(GeometrySet(balls[1:3])))
    assert len({a, b, c}) == 3
    assert allowed(graph, balls) == {(0, 1), (0, 2)}
    assert manager.remove_declaration(b)
    assert allowed(graph, balls) == set()
    assert manager.remove_declaration(a)
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1), (1, 2)}
    assert manager.remove_declaration(c)
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1)}


def test_transient_history(row):
    """Ids tell what is in force; a persistent declaration must wait."""
    graph, _, _, balls = row
    manager = graph.collision_filter_manager()
    assert not manager.has_transient_history()
    filter_id = manager.apply_transient(declare().exclude_within(GeometrySet(balls)))
    assert manager.has_transient_history()
    assert manager.is_active(filter_id)
    with pytest.raises(FilterHistoryError, match="transient declarations are in force"):
        manager.apply(declare().allow_within(GeometrySet(balls)))
    assert allowed(graph, balls) == set()
    assert not manager.remove_declaration(FilterId.get_new_id())
    assert manager.remove_declaration(filter_id)
    assert not manager.remove_declaration(filter_id)
    assert not manager.is_active(filter_id)
    manager.apply(declare().exclude_within(GeometrySet(balls[:2])))
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1)}


def test_removed_geometry_leaves_transient_declarations_in_force(row, world):
    """The rest of a declaration holds; a new geometry does not inherit the old one's part."""
    graph, source, frames, balls = row
    manager = graph.collision_filter_manager()
    filter_id = manager.apply_transient(declare().exclude_within(GeometrySet(balls)))
    graph.remove_geometry(source, balls[0])
    balls[0] = graph.register_geometry(source, frames[0], world.instance("g", proximity=True))
    assert allowed(graph, balls) == {(0, 1), (0, 2), (0, 3), (0, 4)}
    manager.apply_transient(declare().exclude_within(GeometrySet(balls[:2])))
    manager.remove_declaration(filter_id)
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1)}


def test_role_given_again_does_not_revive_transient_declarations(row):
    """An older declaration no longer means a geometry that had lost its role, whatever follows."""
    graph, source, _, balls = row
    manager = graph.collision_filter_manager()
    manager.apply_transient(declare().exclude_within(GeometrySet(balls)))
    graph.remove_role(source, balls[0], Role.PROXIMITY)
    graph.assign_role(source, balls[0], ProximityProperties())
    manager.apply_transient(declare().exclude_within(GeometrySet(balls[:2])))
    assert allowed(graph, balls) == {(0, 2), (0, 3), (0, 4)}


def test_geometry_does_not_inherit_the_filters_of_a_removed_one(row, world):
    """What takes the place of a removed geometry in the filters starts with none."""
    graph, source, frames, balls = row
    manager = graph.collision_filter_manager()
    manager.apply(declare().exclude_between(GeometrySet(balls[0]), GeometrySet(balls[1:3])))
    graph.remove_geometry(source, balls[0])
    balls[0] = graph.register_geometry(source, frames[0], world.instance("g", proximity=True))
    manager.apply(declare().exclude_between(GeometrySet(balls[0]), GeometrySet(balls[4])))
    inspector = graph.model_inspector()
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 4)}
    for i, j in ALL_PAIRS - {(0, 4)}:  # the other way round is another bit
        assert not inspector.collision_filtered(balls[j], balls[i])


def test_model_and_contexts_have_their_own_filters(row):
    """Each manager changes one of them; contexts start with the model's filters."""
    graph, _, _, balls = row
    manager = graph.collision_filter_manager()
    manager.apply(declare().exclude_within(GeometrySet(balls[:2])))
    first, second = graph.create_default_context(), graph.create_default_context()
    in_first = graph.collision_filter_manager(first)
    filter_id = in_first.apply_transient(declare().exclude_within(GeometrySet(balls)))
    manager.apply(declare().exclude_within(GeometrySet(balls[3:])))
    assert allowed(graph, balls) == ALL_PAIRS - {(0, 1), (3, 4)}
    assert allowed(graph, balls, first) == set()
    assert allowed(graph, balls, second) == ALL_PAIRS - {(0, 1)}
    assert not manager.is_active(filter_id)
    in_first.remove_declaration(filter_id)
    assert allowed(graph, balls, first) == ALL_PAIRS - {(0, 1)}


def test_filters_change_the_proximity_version_only(row):
    """A snapshot's shape table stays the same object when only filters change."""
    graph, _, _, balls = row
    context = graph.create_default_context()
    before = context.snapshot
    table = before.proximity.table
    graph.collision_filter_manager(context).apply(declare().exclude_within(GeometrySet(balls)))
    after = context.snapshot
    a, b = before.inspector.geometry_version(), after.inspector.geometry_version()
    assert not a.is_same_as(b, Role.PROXIMITY)
    assert a.is_same_as(b, Role.ILLUSTRATION)
    assert before.proximity.filter_bits is None
    assert after.proximity.filter_bits is not None
    assert after.proximity.table is table


def test_scopes_mean_the_same_while_nothing_deforms(row):
    """Leaving deformable geometry out leaves nothing out."""
    graph, _, _, balls = row
    declaration = CollisionFilterDeclaration(CollisionFilterScope.OMIT_DEFORMABLE)
    graph.collision_filter_manager().apply(declaration.exclude_within(GeometrySet(balls)))
    assert allowed(graph, balls) == set()


@pytest.mark.parametrize("count", [1, 7, 8, 9, 70, 300])
def test_bits_agree_with_the_inspector(count, world):
    """The bit matrix of a snapshot is symmetric and says of each pair what was declared."""
    graph = SceneGraph()
    source = graph.register_source("s")
    generator = np.random.default_rng(count)
    instances = [world.instance(f"g{i}", proximity=True) for i in range(count)]
    frame = [graph.register_frame(source, GeometryFrame(f"f{i}")) for i in range(count)]
    ids = [None] * count
    for i in generator.permutation(count):  # so that rows are not in the order of registration
        ids[i] = graph.register_geometry(source, frame[i], instances[i])
    expected = np.zeros((count, count), dtype=bool)
    manager = graph.collision_filter_manager()
    for k in range(6):
        a, b = (generator.permutation(count)[: max(1, count // 3)] for _ in range(2))
        sets = [GeometrySet([ids[i] for i in members]) for members in (a, b)]
        if k % 3 < 2:
            manager.apply(declare().exclude_between(*sets))
        else:
            manager.apply(declare().allow_between(*sets))
        expected[np.ix_(a, b)] = expected[np.ix_(b, a)] = k % 3 < 2
    bits = graph.create_default_context().snapshot.proximity.filter_bits
    shape = (count, (count + 7) // 8)
    packed = np.zeros(shape, dtype=np.uint8) if bits is None else bits
    assert packed.shape == shape
    unpacked = np.unpackbits(packed, axis=1, count=count, bitorder="little").astype(bool)
    off_diagonal = ~np.eye(count, dtype=bool)
    assert (unpacked == expected)[off_diagonal].all()


def test_transient_declarations_become_persistent(row):
    """Pairs stay as they are; ids are spent, and what is applied next lies on top."""
    graph, _, _, balls = row
    manager = graph.collision_filter_manager()
    manager.apply(declare().exclude_within(GeometrySet(balls[:2])))
    a = manager.apply_transient(declare().exclude_within(GeometrySet(balls)))
    b = manager.apply_transient(declare().allow_within(GeometrySet(balls[:3])))
    context = graph.create_default_context()
    before = allowed(graph, balls)
    assert before == {(0, 1), (0, 2), (1, 2)}
    manager.flatten()
    assert allowed(graph, balls) == before
    assert not manager.has_transient_history()
    assert not manager.is_active(a) and not manager.remove_declaration(b)
    manager.apply(declare().allow_within(GeometrySet(balls[3:])))
    assert allowed(graph, balls) == {*before, (3, 4)}
    manager.flatten()
    assert allowed(graph, balls) == {*before, (3, 4)}
    # A context that was made before keeps its own.
    assert allowed(graph, balls, context) == before
    own = graph.collision_filter_manager(context)
    assert own.is_active(a) and own.remove_declaration(a)
    assert allowed(graph, balls, context) == ALL_PAIRS
