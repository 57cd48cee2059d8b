"""Read SRDF files: which pairs of a robot's links need no check, named postures, groups of joints.

End effectors and planning hints are passed over.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from scene_graph_ros.located import Location, SceneFileError, suggestion
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import JointType
from scene_graph_ros.robots.semantic_model import (
    DisabledPair,
    GroupState,
    SemanticModel,
    VirtualJoint,
)
from scene_graph_ros.scene_files.packages import Packages
from scene_graph_ros.scene_files.urdf import read_robot_text
from scene_graph_ros.scene_files.xml_tree import parse_xml, XmlElement

__all__ = ["load_srdf"]


_MOST_HINTS = 50
"""Warnings of a file with a name that may have been meant; to look for it takes time."""


def load_srdf(
    path_or_xml: str | Path,
    robot: RobotModel,
    *,
    package_map: Mapping[str, str | Path] | None = None,
    package_dirs: Iterable[str | Path] = (),
) -> SemanticModel:
    """Read an SRDF that belongs to ``robot``; the source is given as for ``load_urdf``.

    Names of links and joints that the robot does not have are warnings, since one SRDF often
    serves several variants of a robot; but a file that fits no link at all is refused. Raises
    SceneFileError naming file, line, element and attribute.
    """
    packages = Packages.of(package_map, package_dirs)
    text, label, _ = read_robot_text(path_or_xml, packages)
    root = parse_xml(text, label)
    if root.tag != "robot":
        raise SceneFileError(f"{Location(label, root.line)}: expected <robot>, got <{root.tag}>")
    return _Reader(root, robot).model()


class _Reader:
    def __init__(self, root: XmlElement, robot: RobotModel) -> None:
        self.root = root
        self.robot = robot
        self.warnings: list[str] = []
        self.matched = False

    def model(self) -> SemanticModel:
        name = self.root.attributes.get("name", "").strip()
        pairs = self._disabled_pairs()
        model = SemanticModel(
            robot=name,
            file=self.root.file,
            disabled_pairs=pairs,
            disabled_links=self._disabled_links(),
            enabled_pairs=tuple(
                pair for pair in map(self._pair, self.root.all("enable_collisions")) if pair
            ),
            group_states=tuple(self._states()),
            groups=MappingProxyType(self._groups()),
            virtual_joints=tuple(self._virtual_joints()),
            warnings=tuple(self.warnings),
        )
        collisions = [c for c in self.root.children if "collisions" in c.tag]
        if collisions and not self.matched:
            raise collisions[0].error(
                f"no link of this file is a link of robot {self.robot.name!r}"
                f" ({self.robot.file}): is it another robot's SRDF?"
            )
        return model

    def _link(self, element: XmlElement, attribute: str) -> str | None:
        """Return a link's name, or None with a warning if the robot has no such link."""
        name = element.name(attribute)
        if name in self.robot.links:
            self.matched = True
            return name
        # A robot's relative has a few other names; another robot's file has thousands.
        hint = suggestion(name, self.robot.links) if len(self.warnings) < _MOST_HINTS else ""
        self.warnings.append(
            f"{element.location(attribute)}: robot {self.robot.name!r} has no link {name!r}{hint}"
        )
        return None

    def _pair(self, element: XmlElement) -> tuple[str, str] | None:
        first, second = self._link(element, "link1"), self._link(element, "link2")
        if first is None or second is None:
            return None
        if first == second:
            raise element.error(f"names link {first!r} twice")
        return (min(first, second), max(first, second))

    def _disabled_pairs(self) -> tuple[DisabledPair, ...]:
        found: dict[tuple[str, str], DisabledPair] = {}
        for element in self.root.all("disable_collisions"):
            pair = self._pair(element)
            if pair is not None and pair not in found:
                reason = element.attributes.get("reason", "")
                found[pair] = DisabledPair(*pair, reason, element.location())
        return tuple(found.values())

    def _disabled_links(self) -> tuple[str, ...]:
        elements = self.root.all("disable_default_collisions")
        names = (self._link(element, "link") for element in elements)
        return tuple(dict.fromkeys(name for name in names if name is not None))

    def _states(self) -> Iterable[GroupState]:
        for element in self.root.all("group_state"):
            positions = {}
            for joint in element.all("joint"):
                name = joint.name("name")
                values = joint.string("value").split()
                known = self.robot.joints.get(name)
                if known is None and len(values) != 1:
                    continue  # the pose of a virtual joint between the robot and the world
                if known is None:
                    self._no_joint(joint)
                elif known.type.has_position:
                    positions[name] = joint.number("value")
            yield GroupState(
                element.string("name"), element.attributes.get("group", "").strip(), positions
            )

    def _virtual_joints(self) -> Iterator[VirtualJoint]:
        """Yield the joints between the world and the robot's root link."""
        for element in self.root.all("virtual_joint"):
            kind, link = element.string("type"), self._link(element, "child_link")
            if kind not in ("fixed", "planar", "floating"):
                text = f"left out: expected one of fixed, planar, floating, got type {kind!r}"
                self._warn(element, text)
            elif link is not None and link not in self.robot.fixed_to_root():
                self._warn(
                    element,
                    f"left out, as joints move link {link!r}: a virtual joint is above the root"
                    f" link {self.robot.root!r}",
                )
            elif link is not None:
                name, parent = element.name("name"), element.name("parent_frame")
                yield VirtualJoint(name, kind, parent, link, element.location())

    def _groups(self) -> dict[str, tuple[str, ...]]:
        """Return the joints of each group: its own, those before its links, chains, subgroups."""
        elements: dict[str, XmlElement] = {}
        for element in self.root.all("group"):
            name = element.string("name")
            if name in elements:
                self._warn(element, f"left out, as there is another group called {name!r}")
            elements.setdefault(name, element)
        moving = [j for j in self.robot.joints.values() if j.type is not JointType.FIXED]
        known: dict[str, set[str]] = {}
        for name in elements:
            self._collect_group(name, elements, known, ())
        return {
            name: tuple(joint.name for joint in moving if joint.name in known[name])
            for name in elements
        }

    def _collect_group(
        self,
        name: str,
        elements: Mapping[str, XmlElement],
        known: dict[str, set[str]],
        inside: tuple[str, ...],
    ) -> set[str]:
        """Find the joints of a group, after those of the groups in it."""
        if name in known:
            return known[name]
        element, members = elements[name], set()
        for joint in element.all("joint"):
            if joint.name("name") in self.robot.joints:
                members.add(joint.name("name"))
            else:
                self._no_joint(joint)
        for link in element.all("link"):
            before = self.robot.parent_joint(self._link(link, "name") or "")
            members.update([before.name] if before is not None else [])
        for chain in element.all("chain"):
            members |= self._chain(chain)
        for other in element.all("group"):
            within = other.string("name")
            if within not in elements:
                self._warn(other, f"there is no group {within!r}{suggestion(within, elements)}")
            elif within in (name, *inside):
                self._warn(other, f"left out, as group {within!r} is inside itself")
            else:
                members |= self._collect_group(within, elements, known, (*inside, name))
        known[name] = members
        return members

    def _chain(self, element: XmlElement) -> set[str]:
        """Return the joints between two links: of both branches, below their common part."""
        base, tip = self._link(element, "base_link"), self._link(element, "tip_link")
        if base is None or tip is None:
            return set()
        return self._above(base) ^ self._above(tip)

    def _above(self, link: str) -> set[str]:
        """Return the joints between a link and the root."""
        names = set()
        while (joint := self.robot.parent_joint(link)) is not None:
            names.add(joint.name)
            link = joint.parent
        return names

    def _no_joint(self, element: XmlElement) -> None:
        name = element.string("name")
        self._warn(
            element,
            f"robot {self.robot.name!r} has no joint {name!r}"
            f"{suggestion(name, self.robot.joints)}",
        )

    def _warn(self, element: XmlElement, text: str) -> None:
        attribute = "name" if "name" in element.attributes else ""
        self.warnings.append(f"{element.location(attribute)}: {text}")
