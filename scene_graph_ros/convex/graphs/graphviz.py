"""A graph of convex sets in the DOT language of Graphviz."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.options import GcsGraphvizOptions
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult

__all__ = ["graphviz_string"]


def graphviz_string(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    result: GraphOfConvexSetsResult | None,
    options: GcsGraphvizOptions,
    active_path: Sequence[Edge],
) -> str:
    """Return the drawing, as `GraphOfConvexSets.get_graphviz_string` says."""
    form = f"%.{options.precision}{'e' if options.scientific else 'f'}"
    lines = ["digraph GraphOfConvexSets {", "labelloc=t;"]
    lines += [
        f"v{v.id} [label={_quoted(_vertex_label(v, result, options, form))}]" for v in vertices
    ]
    for edge in edges:
        label = _quoted(_edge_label(edge, result, options, form))
        strength = ""
        if result is not None and options.show_flows:
            share = min(max(result.flows.get(edge.id, 0.0), 0.0), 1.0)
            strength = f", color={_quoted(f'#000000{round(255 * share):02x}')}"
        lines.append(f"v{edge.u.id} -> v{edge.v.id} [label={label}{strength}]")
    lines += [
        f'v{edge.u.id} -> v{edge.v.id} [label="active", color=red, style=dashed]'
        for edge in active_path
    ]
    return "\n".join([*lines, "}", ""])


def _vertex_label(
    vertex: Vertex,
    result: GraphOfConvexSetsResult | None,
    options: GcsGraphvizOptions,
    form: str,
) -> list[str]:
    parts = [vertex.name]
    if result is not None and options.show_vars:
        x = vertex.get_solution(result)
        if x is not None:
            parts.append(f"x = {_numbers(x, form)}")
    return parts


def _edge_label(
    edge: Edge,
    result: GraphOfConvexSetsResult | None,
    options: GcsGraphvizOptions,
    form: str,
) -> list[str]:
    parts = [edge.name]
    if result is None:
        return parts
    cost = edge.get_solution_cost(result)
    if options.show_costs and cost is not None:
        parts.append(f"cost = {form % cost}")
    flow = edge.get_solution_phi(result)
    if options.show_flows and flow is not None:
        parts.append(f"ϕ = {form % flow}")
    for name, x in (
        ("ϕ xᵤ", edge.get_solution_phi_xu(result)),
        ("ϕ xᵥ", edge.get_solution_phi_xv(result)),
    ):
        if options.show_slacks and x is not None:
            parts.append(f"{name} = {_numbers(x, form)}")
    return parts


def _numbers(x: np.ndarray, form: str) -> str:
    return "[" + ", ".join(form % value for value in x) + "]"


def _quoted(text: str | Sequence[str]) -> str:
    """Return text, or lines of it, as a string of DOT."""
    lines = [text] if isinstance(text, str) else text
    escaped = [line.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") for line in lines]
    return '"' + "\\n".join(escaped) + '"'
