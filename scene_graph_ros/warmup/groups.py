"""The one list of kernels: those of the main job, and of each capability that adds to it.

A capability adds one `KernelGroup`. Its effects and queries in the node name the group, which is
compiled when they are first asked for. Nothing is imported by reading this list.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

__all__ = ["GROUPS", "MAIN", "POINTS", "KernelGroup"]

MAIN = "main"
"""The group that all others are built on: everything that is not on demand."""

POINTS = "points"
"""The group that the set-up compiles beside it."""


@dataclass(frozen=True)
class KernelGroup:
    """Kernels that are compiled together.

    ``tasks`` are functions, as ``module:name``, that call the big entry points; they run side by
    side, the slowest first. A part of another's work stands where that is not there yet.
    ``checks`` ask everything after them and find nothing to compile; the tasks themselves where
    there are none. ``kernels`` says about how many are compiled, and ``long_ends`` as how many
    others a task's last kernel takes as long: all others are merged into it. ``is_apart`` says
    that the group builds on no slow kernel of the main job.
    """

    name: str
    what: str
    kernels: int
    tasks: tuple[str, ...]
    checks: tuple[str, ...] = ()
    is_apart: bool = False
    long_ends: Mapping[str, int] = field(default_factory=dict)


_HERE = "scene_graph_ros.warmup"

GROUPS: dict[str, KernelGroup] = {
    group.name: group
    for group in (
        KernelGroup(
            MAIN,
            "all shapes, poses, contacts and distances",
            790,
            (
                f"{_HERE}.main_job:find_pairs",
                f"{_HERE}.main_job:read_meshes",
                f"{_HERE}.main_job:find_candidates",
                f"{_HERE}.main_job:make_models",
                f"{_HERE}.robots:place_links",
                f"{_HERE}.main_job:find_near_contacts",
                f"{_HERE}.main_job:find_contacts_of_kinds",
            ),
            (f"{_HERE}.main_job:ask_main_queries", f"{_HERE}.robots:place_links"),
            long_ends={f"{_HERE}.main_job:find_pairs": 150},
        ),
        # The slowest first: the others are compiled beside it.
        KernelGroup("planning", "planning", 330, (f"{_HERE}.robots:plan",)),
        KernelGroup("surfaces", "contact surfaces", 40, (f"{_HERE}.surfaces:find_surfaces",)),
        KernelGroup(
            "deformable",
            "deformable contact",
            30,
            (f"{_HERE}.deformable:find_deformable_contact",),
        ),
        KernelGroup("clouds", "clouds of points", 40, (f"{_HERE}.clouds:ask_about_clouds",)),
        KernelGroup(
            "sensing",
            "images of depth and clouds of sensors",
            10,
            (f"{_HERE}.sensing:look_at_an_image",),
        ),
        KernelGroup("maps", "maps of voxels", 5, (f"{_HERE}.maps:read_maps",)),
        KernelGroup(
            "cameras", "images of cameras", 75, (f"{_HERE}.cameras:render_images",), is_apart=True
        ),
        KernelGroup(
            POINTS,
            "distances of points, derivatives and certificates",
            150,
            (f"{_HERE}.main_job:measure_points",),
            (f"{_HERE}.main_job:ask_about_points",),
            is_apart=True,
        ),
        KernelGroup(
            "convex", "convex sets", 220, (f"{_HERE}.convex_sets:ask_convex_sets",), is_apart=True
        ),
    )
}
