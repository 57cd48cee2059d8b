"""Read a robot's kinematic tree from its files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.scene_files.srdf import load_srdf
from scene_graph_ros.scene_files.urdf import load_urdf

__all__ = ["load_kinematic_tree"]


def load_kinematic_tree(
    urdf: str | Path,
    srdf: str | Path | None = None,
    *,
    floating_base: str = "",
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
) -> KinematicTree:
    """Read a robot's joints and links from a URDF, and groups of its joints from an SRDF.

    Both are given as for `load_urdf`; ``floating_base`` is the name of a floating joint that is
    put before the root link. Raises SceneFileError naming file, line, element and attribute.
    """
    robot = load_urdf(urdf, package_map=package_map, package_dirs=package_dirs)
    semantics = None
    if srdf is not None:
        semantics = load_srdf(srdf, robot, package_map=package_map, package_dirs=package_dirs)
    return robot.kinematic_tree(semantics, floating_base=floating_base)
