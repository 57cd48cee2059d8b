"""The content of a URDF as plain data: links with their geometry, joints, colours."""

from __future__ import annotations

from dataclasses import dataclass, field
import enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.located import Location

__all__ = [
    "Inertial",
    "Joint",
    "JointType",
    "Link",
    "LinkGeometry",
    "MeshFile",
    "Mimic",
    "Pose",
    "PrimitiveShape",
    "RobotParts",
]

Pose = NDArray[np.float64]


class JointType(enum.Enum):
    """How a joint lets its child move; the values are URDF's words."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    PLANAR = "planar"
    FLOATING = "floating"

    @property
    def has_position(self) -> bool:
        """Tell whether one number, in rad or m, gives the joint's position."""
        return self in (JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC)


@dataclass(frozen=True)
class PrimitiveShape:
    """A box, sphere, cylinder, capsule or ellipsoid; ``size`` in m as URDF gives it.

    box: x, y, z; sphere: radius; cylinder and capsule: radius, length (along z, without caps);
    ellipsoid: its three half axes.
    """

    kind: str
    size: tuple[float, ...]


@dataclass(frozen=True)
class MeshFile:
    """A mesh as named in the file; ``path`` is None if it was not found, for ``reason``."""

    resource: str
    scale: tuple[float, float, float]
    path: Path | None
    reason: str = ""


@dataclass(frozen=True, eq=False)
class LinkGeometry:
    """One ``<collision>`` or ``<visual>``: a shape at ``X_LG`` in its link's frame."""

    name: str
    X_LG: Pose
    shape: PrimitiveShape | MeshFile
    rgba: tuple[float, float, float, float] | None
    location: Location


@dataclass(frozen=True, eq=False)
class Inertial:
    """A link's mass, kg, and its inertia ``(3, 3)``, kg m^2, about the centre of mass at ``p_LI``.

    ``p_LI`` ``(3,)`` and the axes of ``I_L`` are those of the link.
    """

    mass: float
    p_LI: NDArray[np.float64]
    I_L: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Link:
    """A link; geometry is in the order of the file. ``inertial`` is None where none is said."""

    name: str
    collisions: tuple[LinkGeometry, ...]
    visuals: tuple[LinkGeometry, ...]
    location: Location
    inertial: Inertial | None = None


@dataclass(frozen=True)
class Mimic:
    """This joint's position is ``multiplier * position of joint + offset``."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint: at position zero the child link is at ``X_PC`` in its parent link."""

    name: str
    type: JointType
    parent: str
    child: str
    X_PC: Pose
    axis: tuple[float, float, float]
    """Unit vector in the joint's frame; the normal of the plane for a planar joint."""
    lower: float | None
    """Lower limit in rad or m, or None."""
    upper: float | None
    """Upper limit in rad or m, or None."""
    mimic: Mimic | None
    location: Location
    velocity: float | None = None
    """Largest speed in rad/s or m/s, or None."""
    acceleration: float | None = None
    """Largest acceleration in rad/s^2 or m/s^2, or None: no URDF says it."""
    jerk: float | None = None
    """Largest jerk in rad/s^3 or m/s^3, or None."""


@dataclass(frozen=True, eq=False)
class RobotParts:
    """A tree of links; parents come before their children in ``joints``."""

    name: str
    file: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    root: str
    warnings: tuple[str, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())
    """What follows from the file and is good to know, such as limits that were narrowed."""
    doubts: tuple[str, ...] = field(default=())
    """What no such file should say, though the robot can be used: a checker refuses it."""
