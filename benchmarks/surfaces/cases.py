"""The pairs of shapes whose contact surface is known, and how they are placed.

Sizes are such that every body is 10 cm to its deepest place, so that all are equally stiff.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from benchmarks.speed.scenes import random_rotations
from benchmarks.surfaces import closed_forms
from benchmarks.surfaces.closed_forms import Truth
from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Sphere

__all__ = ["CASES", "DEEPEST", "HINTS", "MODULUS", "Body", "Case", "Configuration", "draw"]

DEEPEST = 0.1
"""Metres from the surface of every body to its deepest place, and of slabs to their end."""
MODULUS = 1e6
"""Pa, of every compliant body: soft rubber."""
STIFFNESS = MODULUS / DEEPEST
HINTS = (0.1, 0.05, 0.025, 0.0125, 0.00625)
"""Metres: 1, 1/2, ... 1/16 of the radius."""
DEPTHS = (0.01, 0.03)
"""Metres: depths are drawn evenly from here."""

_LENGTH = 0.3
_SEGMENT = 0.2
_WIDTH, _BREADTH = 0.3, 0.24
_AXES = (0.1, 0.07, 0.13)
_TILTS = np.radians((20.0, 70.0))
_TABLE = Box(0.5, 0.5, 2.0 * DEEPEST)
_SPACING = 1.0
_STEP = np.array([1e-3, -2e-3, 0.0])


class Body(NamedTuple):
    """One body of a pair."""

    shape: Any
    X_PG: np.ndarray
    is_compliant: bool


class Configuration(NamedTuple):
    """A pair at one place; ``force_W`` (N) acts on the upper body through the point C."""

    upper: Body
    lower: Body
    X_WPs: np.ndarray
    """(2, 4, 4): two places a step apart, so that every query has new poses."""
    force_W: np.ndarray
    p_WC: np.ndarray
    area: float


_Make = Callable[[np.random.Generator, float], tuple[Body, Body, Truth]]


@dataclass(frozen=True)
class Case:
    """A pair of shapes, and which of the two is compliant."""

    shapes: str
    sides: str
    """"one compliant" or "both compliant"."""
    detail: str
    """What is rigid, in words."""
    has_hint: bool
    """Whether a mesh of either depends on the resolution hint."""
    make: _Make
    """Returns the upper and the lower body in the frame P, and the truth in P, for a depth."""

    @property
    def name(self) -> str:
        """Shapes and sides."""
        return f"{self.shapes}, {self.detail}"


def _pose(z: float, R: np.ndarray | None = None) -> np.ndarray:
    X = np.eye(4)
    X[2, 3] = z
    if R is not None:
        X[:3, :3] = R
    return X


def _about(axis: int, angle: float) -> np.ndarray:
    """Return the rotation about a coordinate axis."""
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i] = R[j, j] = np.cos(angle)
    R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
    return R


def _lying(rng: np.random.Generator) -> np.ndarray:
    """Return a rotation that lays the z axis along x, after any turn about it."""
    return _about(1, 0.5 * np.pi) @ _about(2, rng.uniform(0.0, 2.0 * np.pi))


def _floor(is_compliant: bool) -> Body:
    return Body(HalfSpace(), np.eye(4), is_compliant)


def _ball(rng: np.random.Generator, z: float, is_compliant: bool) -> Body:
    return Body(Sphere(DEEPEST), _pose(z, random_rotations(rng, 1)[0]), is_compliant)


def _ball_on(lower: Callable[[bool], Body], upper_gives: bool, lower_gives: bool) -> _Make:
    """Place a ball on a half space or table."""
    form = {
        (True, False): closed_forms.ball_on_plane,
        (False, True): closed_forms.ball_in_slab,
        (True, True): closed_forms.ball_on_slab,
    }[upper_gives, lower_gives]

    def make(rng: np.random.Generator, d: float) -> tuple[Body, Body, Truth]:
        ball = _ball(rng, DEEPEST - d, upper_gives)
        return ball, lower(lower_gives), form(DEEPEST, d, STIFFNESS)

    return make


def _table(is_compliant: bool) -> Body:
    return Body(_TABLE, _pose(-DEEPEST), is_compliant)


def _balls(both: bool) -> _Make:
    form = closed_forms.balls if both else closed_forms.ball_in_ball

    def make(rng: np.random.Generator, d: float) -> tuple[Body, Body, Truth]:
        upper, lower = _ball(rng, 2.0 * DEEPEST - d, both), _ball(rng, 0.0, True)
        return upper, lower, form(DEEPEST, d, STIFFNESS)

    return make


def _box(upper_gives: bool, lower_gives: bool) -> _Make:
    form = {
        (True, False): closed_forms.box_on_plane,
        (False, True): closed_forms.box_in_slab,
        (True, True): closed_forms.box_on_slab,
    }[upper_gives, lower_gives]

    def make(rng: np.random.Generator, d: float) -> tuple[Body, Body, Truth]:
        del rng
        box = Body(Box(_WIDTH, _BREADTH, 2.0 * DEEPEST), _pose(DEEPEST - d), upper_gives)
        return box, _floor(lower_gives), form(_WIDTH, _BREADTH, d, STIFFNESS)

    return make


def _tilted_box(upper_gives: bool) -> _Make:
    form = closed_forms.tilted_box_on_plane if upper_gives else closed_forms.tilted_box_in_slab

    def make(rng: np.random.Generator, d: float) -> tuple[Body, Body, Truth]:
        tilt = float(rng.uniform(*_TILTS))
        # About -y, so that the bottom rises towards +x, and the edge below at x = 0.
        X = _pose(0.0, _about(1, -tilt))
        X[:3, 3] = X[:3, :3] @ [0.5 * _WIDTH, 0.0, DEEPEST] - [0.0, 0.0, d]
        box = Body(Box(_WIDTH, _BREADTH, 2.0 * DEEPEST), X, upper_gives)
        return box, _floor(not upper_gives), form(_BREADTH, tilt, d, STIFFNESS)

    return make


def _long(shape: Any, length: float, form: Callable[..., Truth], upper_gives: bool) -> _Make:
    """Place a cylinder or capsule on its side."""

    def make(rng: np.random.Generator, d: float) -> tuple[Body, Body, Truth]:
        body = Body(shape, _pose(DEEPEST - d, _lying(rng)), upper_gives)
        return body, _floor(not upper_gives), form(DEEPEST, length, d, STIFFNESS)

    return make


def _ellipsoid(rng: np.random.Generator, d: float) -> tuple[Body, Body, Truth]:
    R = random_rotations(rng, 1)[0]
    half_width = float(np.linalg.norm(np.array(_AXES) * R[2]))
    body = Body(Ellipsoid(*_AXES), _pose(half_width - d, R), True)
    return body, _floor(False), closed_forms.ellipsoid_on_plane(_AXES, R, d, MODULUS)


_ONE, _BOTH = "one compliant", "both compliant"
_CYLINDER, _CAPSULE = Cylinder(DEEPEST, _LENGTH), Capsule(DEEPEST, _SEGMENT)
_IN_RIGID, _IN_COMPLIANT = "half space rigid", "half space compliant"

CASES = (
    Case("sphere, half space", _ONE, _IN_RIGID, True, _ball_on(_floor, True, False)),
    Case("sphere, half space", _ONE, "sphere rigid", True, _ball_on(_floor, False, True)),
    Case("sphere, half space", _BOTH, _BOTH, True, _ball_on(_floor, True, True)),
    Case("capsule, half space", _ONE, _IN_RIGID, True,
         _long(_CAPSULE, _SEGMENT, closed_forms.capsule_on_plane, True)),
    Case("capsule, half space", _ONE, "capsule rigid", True,
         _long(_CAPSULE, _SEGMENT, closed_forms.capsule_in_slab, False)),
    Case("cylinder, half space", _ONE, _IN_RIGID, True,
         _long(_CYLINDER, _LENGTH, closed_forms.cylinder_on_plane, True)),
    Case("cylinder, half space", _ONE, "cylinder rigid", True,
         _long(_CYLINDER, _LENGTH, closed_forms.cylinder_in_slab, False)),
    Case("ellipsoid, half space", _ONE, _IN_RIGID, True, _ellipsoid),
    Case("sphere, sphere", _ONE, "one rigid", True, _balls(False)),
    Case("sphere, sphere", _BOTH, _BOTH, True, _balls(True)),
    Case("sphere, box", _ONE, "box rigid", True, _ball_on(_table, True, False)),
    Case("sphere, box", _ONE, "sphere rigid", True, _ball_on(_table, False, True)),
    Case("sphere, box", _BOTH, _BOTH, True, _ball_on(_table, True, True)),
    Case("box, half space", _ONE, _IN_RIGID, False, _box(True, False)),
    Case("box, half space", _ONE, "box rigid", False, _box(False, True)),
    Case("box, half space", _BOTH, _BOTH, False, _box(True, True)),
    Case("tilted box, half space", _ONE, _IN_RIGID, False, _tilted_box(True)),
    Case("tilted box, half space", _ONE, "box rigid", False, _tilted_box(False)),
)  # fmt: skip


def draw(case: Case, count: int, rng: np.random.Generator) -> list[Configuration]:
    """Return ``count`` configurations side by side, of all depths and orientations.

    Pairs with a half space are turned about its normal, the others in any way.
    """
    depths = rng.permutation(np.linspace(*DEPTHS, count))
    return [_place(case, k, float(depth), rng) for k, depth in enumerate(depths)]


def _place(case: Case, k: int, depth: float, rng: np.random.Generator) -> Configuration:
    upper, lower, truth = case.make(rng, depth)
    if isinstance(lower.shape, HalfSpace):
        R_WP = _about(2, rng.uniform(0.0, 2.0 * np.pi))
    else:
        R_WP = random_rotations(rng, 1)[0]
    X_WPs = np.array([_pose(0.0, R_WP), _pose(0.0, R_WP)])
    X_WPs[:, 0, 3] = _SPACING * k
    X_WPs[1, :3, 3] += _STEP
    p_WC = R_WP @ truth.p_PC + X_WPs[0, :3, 3]
    return Configuration(upper, lower, X_WPs, truth.force * R_WP[:, 2], p_WC, truth.area)
