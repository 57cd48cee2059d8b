"""Forward kinematics of URDFs from their text, by matrices alone and nothing of the package's.

Also random robots to try it on, and edges between their configurations.
"""

from __future__ import annotations

import math
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

__all__ = ["PlainRobot", "bezier", "random_robot", "slerped"]

_POSITIONS = {"floating": 7, "planar": 3, "fixed": 0}
_PARTS = {"floating": ("qw", "qx", "qy", "qz", "x", "y", "z"), "planar": ("x", "y", "theta")}


def _numbers(text: str | None, default: str) -> np.ndarray:
    return np.array([float(part) for part in (text or default).split()])


def _rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return a rotation by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K)


def _of_quaternion(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _pose(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


class _Joint(NamedTuple):
    kind: str
    parent: str
    child: str
    origin: np.ndarray
    axis: np.ndarray
    start: int
    multiplier: float
    offset: float


class PlainRobot:
    """A URDF's links; positions are in the order of its joints."""

    def __init__(self, urdf: str) -> None:
        """Read joints; the text must name parents first."""
        root = ElementTree.fromstring(urdf)
        self.links = [link.attrib["name"] for link in root.findall("link")]
        self.joints: list[_Joint] = []
        starts: dict[str, int] = {}
        count = 0
        self.position_names: list[str] = []
        for joint in root.findall("joint"):
            kind, name = joint.attrib["type"], joint.attrib["name"]
            place, turn = joint.find("origin"), joint.find("axis")
            attributes = {} if place is None else place.attrib
            roll, pitch, yaw = _numbers(attributes.get("rpy"), "0 0 0")
            x, y, z = np.eye(3)
            R = _rotation(z, yaw) @ _rotation(y, pitch) @ _rotation(x, roll)
            mimic = joint.find("mimic")
            if mimic is None:
                starts[name], own = count, (1.0, 0.0)
                count += _POSITIONS.get(kind, 1)
                if kind != "fixed":
                    parts = _PARTS.get(kind)
                    self.position_names += [f"{name}.{p}" for p in parts] if parts else [name]
            else:
                starts[name] = starts[mimic.attrib["joint"]]
                own = tuple(
                    float(mimic.attrib.get(name, default))
                    for name, default in (("multiplier", "1"), ("offset", "0"))
                )
            self.joints.append(
                _Joint(
                    kind,
                    joint.find("parent").attrib["link"],
                    joint.find("child").attrib["link"],
                    _pose(R, _numbers(attributes.get("xyz"), "0 0 0")),
                    _numbers(None if turn is None else turn.attrib["xyz"], "1 0 0"),
                    starts[name],
                    *own,
                )
            )
        self.num_positions = count

    def poses(self, q: np.ndarray) -> dict[str, np.ndarray]:
        """Return the pose ``(4, 4)`` of each link in the world."""
        result = {self.links[0]: np.eye(4)}
        for joint in self.joints:
            at = q[joint.start : joint.start + _POSITIONS.get(joint.kind, 1)]
            if joint.kind == "floating":
                X = _pose(_of_quaternion(at[:4]), at[4:])
            elif joint.kind == "planar":
                X = _pose(_rotation(np.array([0.0, 0.0, 1.0]), at[2]), np.append(at[:2], 0.0))
            elif joint.kind == "prismatic":
                way = joint.multiplier * at[0] + joint.offset
                X = _pose(np.eye(3), way * joint.axis / np.linalg.norm(joint.axis))
            elif joint.kind == "fixed":
                X = np.eye(4)
            else:
                angle = joint.multiplier * at[0] + joint.offset
                X = _pose(_rotation(joint.axis, angle), np.zeros(3))
            result[joint.child] = result[joint.parent] @ joint.origin @ X
        return result

    def relative(self, q: np.ndarray, frame: str | None, link: str) -> np.ndarray:
        """Return the pose ``(4, 4)`` of a link in another's frame, or the world."""
        X = self.poses(q)
        return X[link] if frame is None else np.linalg.inv(X[frame]) @ X[link]

    def floating(self) -> list[int]:
        """Return where quaternions begin."""
        return [joint.start for joint in self.joints if joint.kind == "floating"]

    def random(self, rng: np.random.Generator) -> np.ndarray:
        """Return positions up to two radians and metres, and any quaternions."""
        q = rng.uniform(-2.0, 2.0, self.num_positions)
        for s in self.floating():
            q[s : s + 4] = rng.standard_normal(4)
        return q


def slerped(robot: PlainRobot, a: np.ndarray, b: np.ndarray, t: float) -> np.ndarray:
    """Return the configuration at t: straight, and quaternions the short way at one speed."""
    q = (1.0 - t) * a + t * b
    for s in robot.floating():
        first, last = a[s : s + 4], b[s : s + 4]
        first, last = first / np.linalg.norm(first), last / np.linalg.norm(last)
        last = last if first @ last >= 0.0 else -last
        across = last - (first @ last) * first
        size = np.linalg.norm(across)
        q[s : s + 4] = first
        if size > 1e-12:
            angle = math.atan2(size, first @ last)
            q[s : s + 4] = math.cos(t * angle) * first + math.sin(t * angle) * across / size
    return q


def bezier(points: np.ndarray, t: float) -> np.ndarray:
    """Return a place on a Bézier curve by its control points ``(m, n)``, with binomials."""
    degree = len(points) - 1
    weights = [math.comb(degree, k) * t**k * (1.0 - t) ** (degree - k) for k in range(degree + 1)]
    return np.array(weights) @ points


def random_robot(rng: np.random.Generator, *, floats: bool) -> str:
    """Return the URDF of a random tree of six links, with a follower; its last link has a ball."""
    kinds = ["revolute", "continuous", "prismatic", "planar", "fixed"]
    ball = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    links, joints = ['<link name="l0"/>'], []
    for i in range(1, 7):
        links.append(f'<link name="l{i}">{ball if i == 6 else ""}</link>')
        kind = str(rng.choice(kinds))
        if i == 1 and floats:
            kind = "floating"
        if i in (3, 6):
            kind = "revolute" if i == 3 else "continuous"
        axis = np.array([0.0, 0.0, 1.0]) if kind == "planar" else rng.standard_normal(3)
        xyz, rpy = rng.uniform(-0.5, 0.5, 3), rng.uniform(-3.0, 3.0, 3)
        text = " ".join
        follow = '<mimic joint="j3" multiplier="-0.7" offset="0.3"/>' if i == 6 else ""
        parent = int(rng.integers(max(0, i - 2), i))
        joints.append(
            f'<joint name="j{i}" type="{kind}"><parent link="l{parent}"/><child link="l{i}"/>'
            f'<origin xyz="{text(map(repr, map(float, xyz)))}"'
            f' rpy="{text(map(repr, map(float, rpy)))}"/>'
            f'<axis xyz="{text(map(repr, map(float, axis)))}"/>'
            f'<limit lower="-3" upper="3"/>{follow}</joint>'
        )
    return f'<robot name="random">{"".join(links)}{"".join(joints)}</robot>'
