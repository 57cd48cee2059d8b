"""Queries whose code is imported when they are first asked.

So are parts of queries that only some scenes need. Their parts - bodies with pressure fields,
tetrahedra, kernels - costs a scene nothing as long as nobody asks. They are in packages above this
one, so they are known here by name only.
"""

from __future__ import annotations

from collections.abc import Callable
import functools
import importlib
from typing import Any

__all__ = ["ON_DEMAND", "on_demand"]

ON_DEMAND = {
    "compute_contact_surfaces": (
        "scene_graph_ros.geometry.hydroelastic.query:compute_contact_surfaces"
    ),
    "compute_contact_surfaces_with_fallback": (
        "scene_graph_ros.geometry.hydroelastic.query:compute_contact_surfaces_with_fallback"
    ),
    "compute_deformable_contact": (
        "scene_graph_ros.geometry.deformable.query:compute_deformable_contact"
    ),
    "ask_what_if": "scene_graph_ros.geometry.query.what_if:ask_what_if",
    "cell_html": "scene_graph_ros.views.notebook:cell_html",
    **{
        name: f"scene_graph_ros.geometry.query.elements.{module}:{name}"
        for module, name in (
            ("ask", "candidates_with_elements"),
            ("ask", "distances_with_elements"),
            ("ask", "elements_collide"),
            ("ask", "pair_distance_of_elements"),
            ("ask", "penetrations_with_elements"),
            ("points", "point_distances_with_elements"),
        )
    },
    "render_images": "scene_graph_ros.geometry.perception.query:render_images",
    "render_one": "scene_graph_ros.geometry.perception.query:render_one",
}
"""The function, as ``module:name``, that answers each query about a Snapshot; the first two take
the query object."""


@functools.cache
def on_demand(query: str) -> Callable[..., Any]:
    """Import and return the function that answers ``query``, one of ON_DEMAND."""
    module, name = ON_DEMAND[query].split(":")
    function: Callable[..., Any] = getattr(importlib.import_module(module), name)
    return function
