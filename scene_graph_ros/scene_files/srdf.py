"""Read SRDF files: which pairs of a robot's links need no collision check, and named postures.

Groups of joints, end effectors, virtual joints and planning hints are passed over.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from scene_graph_ros.located import Location, SceneFileError, suggestion
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.semantic_model import DisabledPair, GroupState, SemanticModel
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
        name = element.string(attribute)
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
                name = joint.string("name")
                values = joint.string("value").split()
                known = self.robot.joints.get(name)
                if known is None and len(values) != 1:
                    continue  # the pose of a virtual joint between the robot and the world
                if known is None:
                    self.warnings.append(
                        f"{joint.location('name')}: robot {self.robot.name!r} has no joint"
                        f" {name!r}{suggestion(name, self.robot.joints)}"
                    )
                elif known.type.has_position:
                    positions[name] = joint.number("value")
            yield GroupState(
                element.string("name"), element.attributes.get("group", "").strip(), positions
            )
