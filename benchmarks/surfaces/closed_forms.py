"""Contact surfaces whose force and area are known, for bodies with exact curved surfaces.

Everything is in a frame P. The lower body B has its top at the plane z = 0 (a half space, the top
face of a box) or its centre on the z axis; the upper body A reaches ``d`` deep into it. ``force``
acts on A, and its line of action passes through ``p_PC``.

Pressure is E * extent, see ``scene_graph_ros.geometry.hydroelastic.body_table``. Near the surface
that is k times the depth below the surface, where k = E / (greatest depth) in Pa/m: E / R for
sphere, capsule and long cylinder of radius R, E / (least half side) for a box, E / thickness for a
slab. Where both bodies give way, they are equally stiff: same k.

Two ideas do most of the work:

- *Level sets.* On a plane patch where p = k * s, force = k * integral over s of the area of the
  part that is deeper than s.
- *Archimedes.* A rigid body in a slab has pressure k * depth on its wetted surface, as in water:
  the force is k * the volume below the plane, upwards through that volume's centroid.
"""

from __future__ import annotations

from math import acos, acosh, asinh, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

__all__ = [
    "Truth",
    "ball_in_ball",
    "ball_in_slab",
    "ball_on_plane",
    "ball_on_slab",
    "balls",
    "box_in_slab",
    "box_on_plane",
    "box_on_slab",
    "capsule_in_slab",
    "capsule_on_plane",
    "cylinder_in_slab",
    "cylinder_on_plane",
    "ellipsoid_on_plane",
    "tilted_box_in_slab",
    "tilted_box_on_plane",
]


class Truth(NamedTuple):
    """What is true of a contact surface."""

    force: float
    """N, along z, on the upper body."""
    area: float
    """m^2."""
    p_PC: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """A point of the force's line of action, m."""


def ball_on_plane(R: float, d: float, k: float) -> Truth:
    """Return the truth for a compliant ball on a rigid plane.

    The patch is the disk of radius a, a^2 = R^2 - h^2, at h = R - d from the centre. With rho the
    distance to the centre, p = k (R - rho) and r dr = rho drho, so
    force = 2 pi k * integral of (R - rho) rho from h to R = 2 pi k (R a^2 / 2 - (R^3 - h^3) / 3).
    """
    h = R - d
    a2 = R * R - h * h
    return Truth(2.0 * pi * k * (0.5 * R * a2 - (R**3 - h**3) / 3.0), pi * a2)


def ball_in_slab(R: float, d: float, k: float) -> Truth:
    """Return the truth for a rigid ball in a slab.

    A cap of height d: area 2 pi R d, volume pi d^2 (R - d / 3); the force by Archimedes.
    """
    return Truth(k * pi * d * d * (R - d / 3.0), 2.0 * pi * R * d)


def ball_on_slab(R: float, d: float, k: float) -> Truth:
    """Return the truth for a compliant ball on a slab, equally stiff.

    Pressures are equal where s, the depth below z = 0, is R - rho. With h = R - d that means
    r^2 + (h + s)^2 = (R - s)^2: the paraboloid s = d / 2 - r^2 / (2 q) with q = R + h, of rim
    a^2 = q d. The force is the integral of k s over the rim's disk, k pi q d^2 / 4, and the area
    2 pi q^2 / 3 ((1 + a^2 / q^2)^(3/2) - 1).
    """
    q = 2.0 * R - d
    area = 2.0 * pi * q * q / 3.0 * ((1.0 + d / q) ** 1.5 - 1.0)
    return Truth(k * pi * q * d * d / 4.0, area)


def balls(R: float, d: float, k: float) -> Truth:
    """Return the truth for two equal compliant balls.

    By symmetry the patch is in the plane halfway between the centres, and each ball presses as
    on a rigid plane, d / 2 deep.
    """
    return ball_on_plane(R, 0.5 * d, k)


def ball_in_ball(R: float, d: float, k: float) -> Truth:
    """Return the truth for a rigid ball in a compliant one of equal radius.

    The patch is the rigid ball's cap inside the other. At the angle f from the axis it is at
    u^2 = R^2 + D^2 - 2 R D cos f from the compliant ball's centre, where D = 2 R - d, so
    u du = R D sin f df and cos f = (K - u^2) / (2 R D) with K = R^2 + D^2. The force along the
    axis is the integral of k (R - u) cos f 2 pi R^2 sin f df, that is
    pi k / D^2 * integral of (R - u) (K - u^2) u du from D - R to R. The cap is R - D / 2 high.
    """
    D = 2.0 * R - d
    K = R * R + D * D

    def antiderivative(u: float) -> float:
        return R * (K * u**2 / 2.0 - u**4 / 4.0) - K * u**3 / 3.0 + u**5 / 5.0

    force = pi * k / D**2 * (antiderivative(R) - antiderivative(D - R))
    return Truth(force, pi * R * d)


def _frustum(w: float, b: float, depth: float) -> float:
    """Return the integral of (w - 2 s) (b - 2 s) over s from 0 to ``depth``."""
    return w * b * depth - (w + b) * depth**2 + 4.0 * depth**3 / 3.0


def box_on_plane(w: float, b: float, d: float, k: float) -> Truth:
    """Return the truth for a compliant box, its bottom w by b, lying d deep in a rigid plane.

    The patch is the whole section. Its pressure is k times the distance to the nearest face: d in
    the middle, less near the rim. Deeper than s is a rectangle w - 2 s by b - 2 s.
    """
    return Truth(k * _frustum(w, b, d), w * b)


def box_in_slab(w: float, b: float, d: float, k: float) -> Truth:
    """Return the truth for a rigid box lying in a slab: its bottom, and d of its four sides."""
    return Truth(k * w * b * d, w * b + 2.0 * (w + b) * d)


def box_on_slab(w: float, b: float, d: float, k: float) -> Truth:
    """Return the truth for a compliant box lying on a slab, equally stiff.

    Pressures are equal d / 2 deep in the middle, and at 45 degrees down to there near the rim.
    """
    inner = (w - d) * (b - d)
    return Truth(k * _frustum(w, b, 0.5 * d), inner + sqrt(2.0) * (w * b - inner))


def tilted_box_on_plane(b: float, tilt: float, d: float, k: float) -> Truth:
    """Return the truth for a compliant box on one edge, of length b along y, in a rigid plane.

    The edge is at x = 0, d deep; the bottom rises towards +x at the angle ``tilt`` (rad). The
    patch runs from -d tan(tilt) to d / tan(tilt), of width c = d / (sin cos), and b along the
    edge. Pressure is k times the distance to bottom, side or one of the two ends. What is deeper
    than s is a rectangle c (1 - s / m) by b - 2 s with m = d / (sin + cos), whose middle is at
    x_0 + s (1 / cos - 1 / sin) / 2: integrate its area, and its area times its middle, over s.
    """
    sine, cosine = sin(tilt), cos(tilt)
    c, m = d / (sine * cosine), d / (sine + cosine)
    middle = 0.5 * d * (cosine / sine - sine / cosine)
    slope = 0.5 * (1.0 / cosine - 1.0 / sine)
    volume = c * (b * m / 2.0 - m * m / 3.0)
    moment = c * (b * m * m - m**3) / 6.0 * slope + middle * volume
    return Truth(k * volume, c * b, (moment / volume, 0.0, 0.0))


def tilted_box_in_slab(b: float, tilt: float, d: float, k: float) -> Truth:
    """Return the truth for a rigid box on one edge in a slab, placed as above.

    A prism is wet: a right triangle with hypotenuse c = d / (sin cos) and height d, b long.
    """
    sine, cosine = sin(tilt), cos(tilt)
    c = d / (sine * cosine)
    centroid = d * (cosine / sine - sine / cosine) / 3.0
    area = b * (d / sine + d / cosine) + c * d
    return Truth(0.5 * k * c * d * b, area, (centroid, 0.0, 0.0))


def cylinder_on_plane(R: float, length: float, d: float, k: float) -> Truth:
    """Return the truth for a compliant cylinder on its side, longer than wide, in a rigid plane.

    The patch is 2 a by the length, a^2 = R^2 - h^2, h = R - d. What is deeper than s is
    2 sqrt((R - s)^2 - h^2) wide and length - 2 s long. With rho = R - s, and L the half length:
    force = 4 k * integral of sqrt(rho^2 - h^2) (L - R + rho) from h to R
    = 4 k ((L - R) (R a - h^2 acosh(R / h)) / 2 + a^3 / 3).
    """
    h, L = R - d, 0.5 * length
    a = sqrt(R * R - h * h)
    force = 4.0 * k * (0.5 * (L - R) * (R * a - h * h * acosh(R / h)) + a**3 / 3.0)
    return Truth(force, 2.0 * a * length)


def cylinder_in_slab(R: float, length: float, d: float, k: float) -> Truth:
    """Return the truth for a rigid cylinder on its side in a slab.

    With f = acos(h / R), the wet section is a segment of area R^2 f - h a and arc 2 R f.
    """
    h = R - d
    a, f = sqrt(R * R - h * h), acos(h / R)
    segment = R * R * f - h * a
    return Truth(k * segment * length, 2.0 * R * f * length + 2.0 * segment)


def capsule_on_plane(R: float, length: float, d: float, k: float) -> Truth:
    """Return the truth for a compliant capsule on its side in a rigid plane.

    The two ends together are a ball. The strip between them adds ``length`` times the integral
    of k (R - sqrt(h^2 + x^2)) from -a to a = k (R a - h^2 asinh(a / h)).
    """
    ball = ball_on_plane(R, d, k)
    h = R - d
    a = sqrt(R * R - h * h)
    strip = k * (R * a - h * h * asinh(a / h))
    return Truth(ball.force + length * strip, ball.area + 2.0 * a * length)


def capsule_in_slab(R: float, length: float, d: float, k: float) -> Truth:
    """Return the truth for a rigid capsule on its side in a slab: a ball and a cylinder."""
    ball = ball_in_slab(R, d, k)
    h = R - d
    a, f = sqrt(R * R - h * h), acos(h / R)
    segment = R * R * f - h * a
    return Truth(ball.force + k * segment * length, ball.area + 2.0 * R * f * length)


def ellipsoid_on_plane(
    axes: tuple[float, float, float], R_PA: np.ndarray, d: float, E: float
) -> Truth:
    """Return the truth for a compliant ellipsoid, turned by R_PA, d deep in a rigid plane.

    With S = diag(axes), y = S^-1 x_A turns it into the unit ball with p = E (1 - |y|). The plane's
    normal n (in A) becomes m = S n / w, w = |S n|, which is also the ellipsoid's half width along
    n, so that the plane is at eta = (w - d) / w from the centre. There areas are abc / w times
    those of the ball (Nanson's relation), and the disk's centre is at y = -eta m. The frame P has
    its origin on the plane, below the ellipsoid's centre.
    """
    a, b, c = axes
    n_A = R_PA.T @ [0.0, 0.0, 1.0]
    Sn = np.array(axes) * n_A
    w = float(np.linalg.norm(Sn))
    eta = (w - d) / w
    scale = a * b * c / w
    force = E * scale * 2.0 * pi * ((1.0 - eta**2) / 2.0 - (1.0 - eta**3) / 3.0)
    centre = R_PA @ (-eta / w * np.array(axes) * Sn) + [0.0, 0.0, w - d]
    x, y, z = centre.tolist()
    return Truth(force, scale * pi * (1.0 - eta**2), (x, y, z))
