"""Sets and options as YAML: read again they are the same, and what is wrong is named."""

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    AffineBall,
    AffineSubspace,
    ConvexHull,
    ConvexSetError,
    GcsGraphvizOptions,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    IrisOptions,
    Point,
    VPolytope,
    yaml_dump_typed,
    yaml_load_typed,
)

RNG = np.random.default_rng(1)
FIELDS = {
    AffineBall: ("B", "center"),
    AffineSubspace: ("basis", "translation"),
    HPolyhedron: ("A", "b"),
    Hyperellipsoid: ("A", "center"),
    Hyperrectangle: ("lb", "ub"),
    Point: ("x",),
    VPolytope: ("vertices",),
}
SETS = [
    AffineBall(RNG.normal(size=(3, 3)), RNG.normal(size=3)),
    AffineSubspace(RNG.normal(size=(3, 2)), RNG.normal(size=3)),
    HPolyhedron(RNG.normal(size=(5, 3)), 1e-300 * RNG.normal(size=5)),
    Hyperellipsoid(RNG.normal(size=(3, 3)), 1e8 * RNG.normal(size=3)),
    Hyperrectangle([-1.0, 1e-12], [2.0, 1.0 / 3.0]),
    Point([0.1, -0.0, 1e22]),
    VPolytope(RNG.normal(size=(4, 3))),
]


@pytest.mark.parametrize("convex", SETS, ids=lambda s: type(s).__name__)
def test_sets_are_read_bit_for_bit(convex):
    """All their arrays."""
    again = yaml_load_typed(yaml_dump_typed(convex), type(convex))
    for name in FIELDS[type(convex)]:
        np.testing.assert_array_equal(getattr(again, name), getattr(convex, name))


def test_options_are_read_and_others_have_their_defaults():
    """Also those with sets, mappings and nothing."""
    options = GraphOfConvexSetsOptions(
        max_rounded_paths=7, gap_tolerance=1e-9, solver="clarabel", solver_options={"max_iter": 60}
    )
    assert yaml_load_typed(yaml_dump_typed(options), GraphOfConvexSetsOptions) == options
    drawn = GcsGraphvizOptions(precision=5, scientific=True)
    assert yaml_load_typed(yaml_dump_typed(drawn), GcsGraphvizOptions) == drawn
    iris = IrisOptions(bounding_region=HPolyhedron.make_unit_box(2), iteration_limit=3)
    again = yaml_load_typed(yaml_dump_typed(iris), IrisOptions)
    assert again.iteration_limit == 3
    np.testing.assert_array_equal(again.bounding_region.A, iris.bounding_region.A)
    assert yaml_load_typed("{iteration_limit: 4}", IrisOptions) == IrisOptions(iteration_limit=4)


@pytest.mark.parametrize(
    ("text", "schema", "message"),
    [
        ("[1, 2]", Point, "Point: must be a mapping of fields, not a value of type list"),
        ("{x: [1], y: 2}", Point, "Point has no field 'y'"),
        ("{A: [[1]]}", HPolyhedron, "HPolyhedron: b is missing"),
        ("{x: [one]}", Point, "Point"),
        ("{x: [", Point, "no YAML"),
        ("{precision: 3}", IrisOptions, "IrisOptions has no field 'precision'"),
        ("{iteration_limit: 0}", IrisOptions, "iteration_limit must be a whole number"),
        ("{x: [1]}", dict, "schema must be a class of options"),
        ("{x: [1]}", 3, "schema must be a class of options"),
        (b"{}", Point, "data must be text"),
    ],
)
def test_what_is_wrong_is_named(text, schema, message):
    """With the class that was asked for."""
    with pytest.raises(ConvexSetError, match=message):
        yaml_load_typed(text, schema)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (ConvexHull([Point([0.0])]), "must be options or one of AffineBall"),
        (3, "must be options or one of AffineBall"),
        (IrisOptions, "must be options or one of AffineBall"),
        (IrisOptions(termination_func=lambda r: False), "termination_func can't be written"),
    ],
)
def test_what_yaml_can_not_have_is_refused(value, message):
    """Functions, and sets that are put together."""
    with pytest.raises(ConvexSetError, match=message):
        yaml_dump_typed(value)
