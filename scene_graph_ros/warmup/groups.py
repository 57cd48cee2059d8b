"""The one list of kernels: those of the main job, and of each capability that adds to it.

A capability adds one `KernelGroup`. Its effects and queries in the node name the group, which is
compiled when they are first asked for. Nothing is imported by reading this list.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["GROUPS", "MAIN", "KernelGroup"]

MAIN = "main"
"""The group that the set-up compiles: everything that is not on demand."""


@dataclass(frozen=True)
class KernelGroup:
    """Kernels that are compiled together.

    ``tasks`` are functions, as ``module:name``, that call the big entry points; they run side by
    side, the slowest first. A part of another's work stands where that is not there yet.
    ``checks`` ask everything after them and find nothing to compile; the tasks themselves where
    there are none. ``kernels`` says about how many are compiled. ``is_apart`` says that it builds
    on no slow kernel of the main job.
    """

    name: str
    what: str
    kernels: int
    tasks: tuple[str, ...]
    checks: tuple[str, ...] = ()
    is_apart: bool = False


_HERE = "scene_graph_ros.warmup"

GROUPS: dict[str, KernelGroup] = {
    group.name: group
    for group in (
        KernelGroup(
            MAIN,
            "all shapes, poses, contacts and distances",
            850,
            (
                f"{_HERE}.main_job:find_pairs",
                f"{_HERE}.main_job:measure_points",
                f"{_HERE}.main_job:read_meshes",
                f"{_HERE}.main_job:find_candidates",
                f"{_HERE}.main_job:make_models",
                f"{_HERE}.robots:place_links",
                f"{_HERE}.main_job:find_near_contacts",
                f"{_HERE}.main_job:find_contacts_of_kinds",
            ),
            (f"{_HERE}.main_job:ask_main_queries", f"{_HERE}.robots:place_links"),
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
            "cameras", "images of cameras", 65, (f"{_HERE}.cameras:render_images",), is_apart=True
        ),
        KernelGroup(
            "convex", "convex sets", 220, (f"{_HERE}.convex_sets:ask_convex_sets",), is_apart=True
        ),
    )
}
