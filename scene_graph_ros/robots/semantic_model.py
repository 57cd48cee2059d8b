"""An SRDF's content as plain data: pairs of links without checks, postures, groups of joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.tolerances import ROTATION_DEFECT
from scene_graph_ros.located import Location, SceneFileError

__all__ = ["DisabledPair", "GroupState", "SemanticModel", "VirtualJoint"]


@dataclass(frozen=True)
class DisabledPair:
    """Two links, in alphabetical order, that need no collision check, with the file's reason."""

    link_A: str
    link_B: str
    reason: str
    location: Location


@dataclass(frozen=True)
class GroupState:
    """A named posture of a group of joints; positions in rad or m."""

    name: str
    group: str
    positions: Mapping[str, float]


@dataclass(frozen=True)
class VirtualJoint:
    """A joint between the world and a robot's root link, of type fixed, planar or floating."""

    name: str
    type: str
    parent_frame: str
    child_link: str
    location: Location

    def problem(self, X: NDArray[np.float64]) -> str:
        """Say why a pose ``(4, 4)`` of the link can't be, "" where it can."""
        if self.type == "floating":
            return ""
        if self.type == "fixed":
            return "the virtual joint is fixed"
        lift, tilt = abs(float(X[2, 3])), float(np.abs(X[:3, 2] - (0.0, 0.0, 1.0)).max())
        if max(lift, tilt) <= ROTATION_DEFECT:
            return ""
        return (
            f"the virtual joint is planar: the pose leaves its plane by {lift:g} m and a tilt of "
            f"{tilt:g}"
        )


@one_line()
@dataclass(frozen=True)
class SemanticModel:
    """Collisions, postures and groups of joints of one robot, from an SRDF."""

    robot: str
    file: str
    disabled_pairs: tuple[DisabledPair, ...]
    disabled_links: tuple[str, ...]
    """Links that are checked with no other link unless a pair is enabled."""
    enabled_pairs: tuple[tuple[str, str], ...]
    """Exceptions from ``disabled_links``, each in alphabetical order."""
    group_states: tuple[GroupState, ...]
    warnings: tuple[str, ...] = ()
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))
    """The joints of each group, in the robot's order; fixed ones are left out."""

    virtual_joints: tuple[VirtualJoint, ...] = ()

    def filtered_pairs(self, links: Iterable[str]) -> set[tuple[str, str]]:
        """Return the pairs among ``links`` that are not to be checked, each in order.

        As in MoveIt: links disabled by default first, then enabled pairs, then disabled pairs.
        """
        known = sorted(set(links))
        pairs = {
            (min(link, other), max(link, other))
            for link in self.disabled_links
            for other in known
            if other != link and link in known
        }
        pairs -= set(self.enabled_pairs)
        members = set(known)
        pairs |= {
            (pair.link_A, pair.link_B)
            for pair in self.disabled_pairs
            if pair.link_A in members and pair.link_B in members
        }
        return pairs

    def group_state(self, name: str, group: str | None = None) -> GroupState:
        """Return a posture by name. Raises SceneFileError if there is none, or it is ambiguous."""
        found = [
            state
            for state in self.group_states
            if state.name == name and (group is None or state.group == group)
        ]
        if len(found) != 1:
            names = sorted(f"{state.name} (group {state.group})" for state in self.group_states)
            problem = "no" if not found else "more than one"
            raise SceneFileError(
                f"{self.file}: {problem} group state {name!r}; there are: {', '.join(names)}"
            )
        return found[0]
