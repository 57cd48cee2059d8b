"""Convex sets, scenes and cameras take arrays in every form, or refuse them in our words."""

from array_arguments import array_arguments, ARRAYS_OR_ANYTHING
from form_checks import check_forms
import pytest
from set_calls import CALLS

MODULES = (
    "scene_graph_ros.geometry",
    "scene_graph_ros.geometry.optimization",
    "scene_graph_ros.geometry.perception",
)
CASES = [(name, argument) for name, (_, arrays) in CALLS.items() for argument in arrays]
FEW = ("C", "Fortran", "negative strides", "read-only", "unaligned", ">f4", "i8", "list")
WHOLE = ("i1", "i2", ">i4", "i8", "u1", "u8")
SLOW = {"iris", "HPolyhedron.simplify_by_incremental_face_translation"}


@pytest.mark.parametrize(("name", "argument"), CASES)
@pytest.mark.filterwarnings("ignore:the matrix subclass")
@pytest.mark.filterwarnings("error::numpy.exceptions.ComplexWarning")
def test_every_form_of_an_array_is_the_same_or_refused(name, argument):
    """The result is that of the plain array; what is no real number raises an error of ours."""
    call, arrays = CALLS[name]
    forms = WHOLE if argument in ("faces", "triangles") else FEW if name in SLOW else None
    check_forms(call, arrays, argument, forms)


OF_PROGRAMS = (
    *("constraint", "exponential_cone", "linear_cost", "linear_equations"),
    *("linear_inequalities", "positive_semidefinite", "second_order_cone"),
)
OPTIONS = ("preprocessing_solver_options", "restriction_solver_options", "solver_options")
NO_ARRAYS = {
    "sets": (
        *(("CartesianProduct.__init__", "sets"), ("ConvexHull.__init__", "sets")),
        *(("Intersection.__init__", "sets"), ("MinkowskiSum.__init__", "sets")),
        *(("Certificate.__init__", "of"), ("Certificate.verify", "sets")),
        *(("iris", "obstacles"), ("Reduction.verify", "polyhedron")),
        ("Hyperrectangle.maybe_calc_axis_aligned_bounding_box", "convex_set"),
    ),
    "variables of a program, or an expression of them": (
        *((f"ConicProgram.add_{name}", "x") for name in OF_PROGRAMS),
        *(("ConicProgram.add_semidefinite_matrix", "X"), ("ConicProgram.as_variables", "value")),
        ("ConicSolution.value", "variables"),
        ("ConvexSet.add_point_in_set_constraints", "x"),
        ("ConvexSet.add_point_in_nonnegative_scaling_constraints", "point_and_scale"),
    ),
    "costs, constraints, functions and options": (
        *((f"{part}.get_solution_cost", "cost") for part in ("Edge", "Vertex")),
        *(("Costly.add_cost", "cost"), ("Costly.add_constraint", "constraint")),
        *(("Costly.cost_at", "costs"), ("Costly.discard_constraint", "constraint")),
        *(("FunctionConstraint.__init__", "function"), ("ConicProgram.solve", "solver_options")),
        *(("GraphOfConvexSetsOptions.__init__", name) for name in OPTIONS),
        ("ImplicitGraphOfConvexSets.solve_shortest_path", "heuristic"),
        ("GraphOfConvexSets.solve_convex_restriction", "initial_guess"),
    ),
    "what answers have in them, and what reads these": (
        *(("ConicSolution.__init__", name) for name in ("duals", "values")),
        *(("ConicConstraint.__init__", name) for name in ("constant", "matrix", "variables")),
        *(("ConicConstraint.rows_at", "values"), ("ConicConstraint.violation", "values")),
        *(("ConicProgram.cost", "values"), ("Costly.cost_at", "points")),
        *(("FunctionConstraint.at", "points"), ("GraphOfConvexSetsResult.__init__", "points")),
        ("GraphOfConvexSetsResult.__init__", "slack_variables"),
        ("RegionCut.__init__", "point"),
    ),
    "values of properties, names, colours and functions": (
        *((f"GeometryProperties.{name}_property", "value") for name in ("add", "update")),
        ("GeometryProperties.get_property_or_default", "default_value"),
        ("RenderQueries.get_render_engine_by_name", "name"),
        *(("RendererRegistry.has_renderer", "name"), ("SceneGraph.provide_queries", "query_type")),
        ("yaml_dump_typed", "value"),
        *(("Rgba.from_value", "value"), ("make_phong_illustration_properties", "diffuse")),
    ),
    "for renderers, by the query object, which has checked them": (
        *((f"{kind}RenderEngine.render", "X_WS") for kind in ("", "Exact", "Traced")),
        ("GltfClientRenderEngine.render", "X_WS"),
    ),
    "may be infinite, as numbers beyond float64 then are; else as the lower bound": (
        ("FunctionConstraint.__init__", "upper_bound"),
        ("Costly.new_slack_variables", "upper_bound"),
    ),
    "A and b by position, which are in the table by name": (
        *(("CartesianProduct.__init__", name) for name in ("other", "reference_frame")),
    ),
    "another name of one in the table": (
        *(("MeshShape.__init__", name) for name in ("faces", "vertices")),
        ("ask_what_if", "configurations"),
    ),
}
"""Arguments that may be anything, or arrays, and are not in the table, by the reason."""


def test_each_public_function_of_arrays_is_in_the_table():
    """Or what it takes is named above with the reason why not."""
    named = {each for some in NO_ARRAYS.values() for each in some}
    known = array_arguments(*MODULES, words=ARRAYS_OR_ANYTHING)
    assert known - set(CASES) - named == set()
    assert named <= known
    assert named.isdisjoint(CASES)
