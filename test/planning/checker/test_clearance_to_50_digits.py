"""Clearances and their derivatives beside the same to 50 digits, by formulas of their own.

mpmath turns and slides the links by its own sines and cosines. Its distances are those of points,
segments and planes: a ball from a box's face, edge and corner, two capsules, a ball from a
cylinder's wall. Derivatives are differences of these at 1e-20.
"""

import mpmath
import numpy as np
import pytest
from robot_scenes import diagram

from scene_graph_ros.planning import SceneGraphCollisionChecker

DIGITS = 50
STEP = mpmath.mpf(10) ** -20

# Two hinges and a rail; the last link carries the ball or capsule.
ARM = """<robot name="arm"><link name="base"/><link name="upper"/><link name="lower"/>
  <link name="tip"><collision><origin xyz="0.1 0.05 -0.02" rpy="0.3 0.7 -0.4"/>
  <geometry>{shape}</geometry></collision></link>
  <joint name="yaw" type="revolute"><parent link="base"/><child link="upper"/>
  <origin xyz="0.1 0.2 0.3"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" velocity="1"/></joint>
  <joint name="pitch" type="revolute"><parent link="upper"/><child link="lower"/>
  <origin xyz="0.5 0 0.1"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" velocity="1"/></joint>
  <joint name="reach" type="prismatic"><parent link="lower"/><child link="tip"/>
  <origin xyz="0.4 0 0"/><axis xyz="1 0 0"/>
  <limit lower="-1" upper="1" velocity="1"/></joint></robot>"""
BALL, CAPSULE = '<sphere radius="0.07"/>', '<capsule radius="0.03" length="0.3"/>'
AROUND = """
geometries:
  - {{name: post, source: around, pose: {{xyz: [1.3, 0.6, 0.2]}}, shape: {shape}}}
"""
CENTER = ("1.3", "0.6", "0.2")


def vector(*values):
    """Return a column to 50 digits, of decimals or of doubles as they are."""
    return mpmath.matrix([mpmath.mpf(value) for value in values])


def about(axis, angle):
    """Return the rotation about x, y or z (0, 1, 2)."""
    c, s = mpmath.cos(angle), mpmath.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = mpmath.eye(3)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


def tip(q):
    """Return where the last link's shape is, and along what its z axis points, in W."""
    R1 = about(2, q[0])
    R2 = R1 * about(1, q[1])
    p = vector("0.1", "0.2", "0.3") + R1 * vector("0.5", "0", "0.1")
    p += R2 * (vector("0.4", "0", "0") + q[2] * vector("1", "0", "0"))
    p += R2 * vector("0.1", "0.05", "-0.02")
    own = about(2, mpmath.mpf("-0.4")) * about(1, mpmath.mpf("0.7")) * about(0, mpmath.mpf("0.3"))
    return p, R2 * own * vector("0", "0", "1")


def from_box(q):
    """Return the distance of the ball from a box of 0.4 x 0.2 x 0.3."""
    p, _ = tip(q)
    local = p - vector(*CENTER)
    half = (mpmath.mpf("0.2"), mpmath.mpf("0.1"), mpmath.mpf("0.15"))
    out = [max(abs(x) - h, mpmath.mpf(0)) for x, h in zip(local, half, strict=True)]
    return mpmath.sqrt(sum(x * x for x in out)) - mpmath.mpf("0.07")


def from_wall(q):
    """Return the distance of the ball from the wall of a cylinder along z, of radius 0.15."""
    p, _ = tip(q)
    x, y, _ = p - vector(*CENTER)
    return mpmath.hypot(x, y) - mpmath.mpf("0.15") - mpmath.mpf("0.07")


def from_capsule(q):
    """Return the distance of the capsule from one along z, of radius 0.05 and length 0.6.

    The nearest of the ends of both segments from the other one, and of both lines where their
    nearest points are within the segments.
    """
    p, d = tip(q)
    a, e = vector(*CENTER), vector("0", "0", "1")
    s, t = mpmath.mpf("0.15"), mpmath.mpf("0.3")

    def clamp(value, limit):
        return min(max(value, -limit), limit)

    def dot(u, v):
        return sum(x * y for x, y in zip(u, v, strict=True))

    def apart(i, j):
        gap = p + i * d - a - j * e
        return mpmath.sqrt(dot(gap, gap))

    found = [apart(i, clamp(dot(p + i * d - a, e), t)) for i in (-s, s)]
    found += [apart(clamp(dot(a + j * e - p, d), s), j) for j in (-t, t)]
    b, w = dot(d, e), p - a
    i = (b * dot(e, w) - dot(d, w)) / (1 - b * b)
    j = (dot(e, w) - b * dot(d, w)) / (1 - b * b)
    if abs(i) <= s and abs(j) <= t:
        found.append(apart(i, j))
    return min(found) - mpmath.mpf("0.03") - mpmath.mpf("0.05")


CASES = {
    "ball_box": (BALL, "{type: box, size: [0.4, 0.2, 0.3]}", from_box),
    "ball_cylinder": (BALL, "{type: cylinder, radius: 0.15, length: 4}", from_wall),
    "capsules": (CAPSULE, "{type: capsule, radius: 0.05, length: 0.6}", from_capsule),
}


@pytest.mark.parametrize("case", CASES)
def test_distances_and_derivatives_to_50_digits(tmp_path, case):
    """Both to 1e-13 where they are apart and smooth, at 60 configurations."""
    own, around, truth = CASES[case]
    robots = diagram(tmp_path, ARM.format(shape=own), AROUND.format(shape=around))
    checker, rng = SceneGraphCollisionChecker(robots), np.random.default_rng(6)
    worst, looked = np.zeros(2), 0
    with mpmath.workdps(DIGITS):
        while looked < 60:
            q = rng.uniform([-1.0, -1.0, -0.3], [2.0, 1.0, 0.6])
            exact = [mpmath.mpf(float(value)) for value in q]
            distance = truth(exact)
            if distance < mpmath.mpf("0.01"):
                continue
            found = checker.calc_robot_clearance(q, 10.0)
            assert found.size == 1
            worst[0] = max(worst[0], abs(float(found.distances[0] - distance)))
            for k in range(3):
                ends = []
                for sign in (1, -1):
                    moved = list(exact)
                    moved[k] += sign * STEP
                    ends.append(truth(moved))
                slope = (ends[0] - ends[1]) / (2 * STEP)
                worst[1] = max(worst[1], abs(float(found.jacobians[0, k] - slope)))
            looked += 1
    assert worst[0] < 1e-13
    assert worst[1] < 1e-13, worst
