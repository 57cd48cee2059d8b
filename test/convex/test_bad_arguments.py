"""Every public class and function, each argument in turn replaced by what it can't be.

What comes of it is an answer, or an error of this package; never one of NumPy's or Python's.
"""

import inspect
import math

import numpy as np
import pytest

from scene_graph_ros.geometry import optimization
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    AffineSubspace,
    CartesianProduct,
    ConicProgram,
    ConvexHull,
    FunctionConstraint,
    GraphOfConvexSets,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    ImplicitGraphOfConvexSets,
    Intersection,
    MinkowskiSum,
    norm,
    Point,
    Spectrahedron,
    VPolytope,
)

BOX = HPolyhedron.make_unit_box(2)
FORMS = [np.eye(2), [[1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [1.0, 0.0]]]

BAD = [
    *(None, "x", math.nan, math.inf, -1, 2.5, 10**30, 1j, object(), len, {}),
    *([], [math.nan], [1.0, 2.0], [[1.0, 2.0], [3.0]], [None], ["a"], np.zeros((0, 2))),
    *(np.zeros((2, 2, 2)), Point([0.0]), [Point([0.0, 0.0]), Point([0.0])], VPolytope()),
]

GOOD = {
    **{name: [0.0, 0.0] for name in ("x", "center", "lb", "sample", "translation")},
    **dict.fromkeys(("other", "circumbody", "convex_set", "domain", "set", "region"), BOX),
    "A": np.eye(2),
    "B": np.eye(2),
    "b": np.ones(2),
    "ub": [1.0, 1.0],
    "F": FORMS,
    "c": [1.0],
    "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    "direction": [1.0, 0.0],
    "radius": 1.0,
    "dim": 2,
    "n": 2,
    "count": 2,
    "order": 2,
    "index": 0,
    "num_samples": 10,
    "max_num_samples": 100,
    "y": [0.0],
    "vertices": [[0.0, 0.0], [1.0, 0.0]],
    "basis": [[1.0], [0.0]],
    "scale": 0.5,
    "sets": [BOX],
    "obstacles": [Point([3.0, 3.0])],
    "continuous_revolute_joints": [0],
    "convex_sets_A": [Point([0.0, 0.0]), Point([1.0, 1.0])],
    "regions": {"a": BOX},
}
"""What is given for the other arguments."""

ANY_OBJECT = {"certificate", "remove_empty_sets", "check_for_redundancy", "phi_value"} | {
    "do_affine_transformation",
    "keep_whole_intersection",
    "require_sample_point_is_contained",
    "verify_domain_boundedness",
    "preprocess_bbox",
    "name",
    "ignored",
    "among",
}
"""Flags, names, and what is only asked whether it holds something: Python's own rules."""


class Chain(ImplicitGraphOfConvexSets):
    """Makes nothing."""

    def do_successors(self, v):
        """Return no edges."""
        return []


def small_graph():
    """A graph of two sets, these, and the edge between them."""
    graph = GraphOfConvexSets()
    u, v = graph.add_vertex(BOX), graph.add_vertex(Point([2.0, 0.0]))
    edge = graph.add_edge(u, v)
    edge.add_cost(norm(edge.xv - edge.xu))
    return graph, u, v, edge


def instances():
    """One of each kind that answers questions."""
    graph, u, _, edge = small_graph()
    program = ConicProgram()
    program.add_variables(2)
    return [
        *(BOX, VPolytope(BOX), Hyperrectangle([0.0, 0.0], [1.0, 1.0]), Point([0.0, 0.0])),
        *(AffineSubspace([[1.0], [0.0]], [0.0, 0.0]), Hyperellipsoid.make_unit_ball(2)),
        *(AffineBall.make_unit_ball(2), Spectrahedron(FORMS), Intersection([BOX, BOX])),
        *(MinkowskiSum([BOX, BOX]), CartesianProduct([Point([0.0]), Point([1.0])])),
        *(ConvexHull([BOX, BOX]), graph, u, edge, Chain(), program),
    ]


def callables():
    """Public functions, constructors, and methods of each class."""
    for name in optimization.__all__:
        public = getattr(optimization, name)
        is_record = inspect.isclass(public) and (
            issubclass(public, (Exception, tuple, int))
            or name in {"Certificate", "ConicConstraint", "ConicSolution", "IrisRegion"}
            or name in {"GraphOfConvexSetsResult", "PathBound", "Reduction", "RegionCut"}
            or name in {"Separation", "ImplicitGraphOfConvexSets", "ConvexSet", "Vertex", "Edge"}
        )
        if callable(public) and not is_record:
            yield name, public
    for of in instances():
        for name in dir(type(of)):
            is_plain = isinstance(inspect.getattr_static(of, name), property)
            if not (name.startswith("_") or is_plain) and inspect.isroutine(getattr(of, name)):
                yield f"{type(of).__name__}.{name}", getattr(of, name)


INTERNAL = {
    # For the package's own code, which knows what it gives.
    *("Edge.keep_terms", "Edge.kept_terms", "ConicProgram.as_variables", "ConicProgram.cost"),
    *("ConicProgram.add_constraint", "Vertex.cost_at", "Edge.cost_at"),
}


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
@pytest.mark.parametrize(
    ("label", "function"), [each for each in callables() if each[0] not in INTERNAL]
)
def test_what_an_argument_can_not_be_is_said(label, function, tmp_path, monkeypatch):
    """In 22 ways for each argument."""
    monkeypatch.chdir(tmp_path)
    good = {
        **GOOD,
        "generator": np.random.default_rng(0),
        "filename": tmp_path / "regions.yaml",
        "program": ConicProgram(),
    }
    graph = getattr(function, "__self__", None)
    if isinstance(graph, GraphOfConvexSets):
        # What it removes and makes would change the graph of the others.
        graph, u, v, edge = small_graph()
        function = getattr(graph, function.__name__)
        good |= {"source": u, "target": v, "u": u, "v": v, "vertex": u, "active_edges": [edge]}
        result = graph.solve_shortest_path(u, v)
        good |= {"edge": edge, "of": edge, "flows": {edge: 1.0}, "result": result}
    parameters = [
        (name, parameter)
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.kind not in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL)
    ]
    for name, _ in parameters:
        if name in ANY_OBJECT:
            continue
        for bad in BAD:
            given, named = [], {}
            for other, parameter in parameters:
                default = None if parameter.default is parameter.empty else parameter.default
                value = bad if other == name else good.get(other, default)
                if parameter.kind is parameter.KEYWORD_ONLY:
                    named[other] = value
                else:
                    given.append(value)
            try:
                function(*given, **named)
            except (SceneGraphError, OSError):
                pass
            except Exception as error:  # noqa: BLE001 - whatever else it is
                pytest.fail(f"{label}({name}={bad!r}): {error!r}")


def test_functions_of_a_restriction_say_what_they_are_not():
    """A constraint without a function, or with bounds that cross."""
    for given in ((None, 0.0, 1.0), (len, 1.0, 0.0), (len, "x", 1.0), (len, [0.0], [1.0, 2.0])):
        with pytest.raises(SceneGraphError, match="FunctionConstraint"):
            FunctionConstraint(*given)
