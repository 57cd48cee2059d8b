"""Force, area and pressure of contact surfaces against closed forms, on bodies made by hand."""

import itertools
import math

from contact_bodies import (
    at,
    compliant_box,
    compliant_half_space,
    compliant_sphere,
    rigid_box,
    rigid_half_space,
    rigid_sphere,
    slab,
    solve,
)
import numpy as np
import pytest

E = 2e5


def _only(patches):
    """The totals of the one surface: area, centroid, force on M, moment about the centroid."""
    assert len(patches.rows) == 1
    total = patches.totals[0]
    return total[0], total[1:4], total[4:7], total[7:10]


def _about_x(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


@pytest.mark.parametrize("triangles", [True, False])
def test_rigid_box_in_a_slab(triangles):
    """A rigid box pressed by d into a slab: p = E d / H on its bottom, 4 walls of height d.

    The pressures of opposite walls cancel. H is the slab's height 1.
    """
    d, half = 0.07, np.array([0.25, 0.2, 0.3])
    bodies = [slab(np.array([1.0, 1.0, 0.5]), E, cells=3), rigid_box(half)]
    patches = solve(bodies, [at(), at(0.1, 0.05, 0.5 + half[2] - d)], triangles)
    area, centroid, force, moment = _only(patches)
    bottom, walls = 0.5 * 0.4, 2 * (0.5 + 0.4) * d
    assert area == pytest.approx(bottom + walls, rel=1e-12)
    expected = (bottom * (0.5 - d) + walls * (0.5 - 0.5 * d)) / (bottom + walls)
    assert centroid == pytest.approx([0.1, 0.05, expected], rel=1e-12)
    assert force == pytest.approx([0.0, 0.0, -bottom * E * d], rel=1e-12, abs=1e-9)
    assert moment == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    # Everywhere, walls included, the pressure is that of the depth below the slab's top.
    assert patches.pressure == pytest.approx(E * (0.5 - patches.vertices_W[:, 2]), abs=1e-8)
    assert patches.pressure.max() == pytest.approx(E * d, rel=1e-12)


def test_box_on_a_half_space():
    """A box with pyramids of pressure, E (1 - |x|), on a plane at depth d: a frustum of pressure.

    F = E d / 3 (A_0 + A_d + sqrt(A_0 A_d)) with the areas 4 of the face and 4 (1 - d)^2 of the
    plateau; the largest pressure is E d, the area that of the face.
    """
    d = 0.1
    patches = solve([compliant_box(np.ones(3), E), rigid_half_space()], [at(z=1.0 - d), at()])
    area, centroid, force, _ = _only(patches)
    plateau = 4.0 * (1.0 - d) ** 2
    assert area == pytest.approx(4.0, rel=1e-12)
    assert centroid == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    expected = E * d / 3.0 * (4.0 + plateau + math.sqrt(4.0 * plateau))
    assert force == pytest.approx([0.0, 0.0, expected], rel=1e-12, abs=1e-8)
    assert patches.pressure.max() == pytest.approx(E * d, rel=1e-12)


def test_box_on_its_edge():
    """A box turned by 45 degrees, its edge d below a plane: p = E min(distance to a face).

    Across, the nearest of the two lower faces is delta = (d - |s|) / sqrt(2) away; towards the
    ends at x = +-1 it is 1 - |x|. With u = d - |s|, F = E int int min(delta, 1 - |x|) dx ds
    = E int (2 delta - delta^2) ds = 2 E (d^2 / sqrt(2) - d^3 / 6), and A = 2 . 2 d.
    """
    d = 0.2
    pose = at(z=math.sqrt(2.0) - d, R=_about_x(math.pi / 4))
    area, centroid, force, _ = _only(
        solve([compliant_box(np.ones(3), E), rigid_half_space()], [pose, at()])
    )
    assert area == pytest.approx(4.0 * d, rel=1e-12)
    assert centroid == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    expected = 2.0 * E * (d**2 / math.sqrt(2.0) - d**3 / 6.0)
    assert force == pytest.approx([0.0, 0.0, expected], rel=1e-11, abs=1e-8)


def _sphere_on_plane(radius, h):
    """Force and area of p = E (1 - r / R) over the disc of a sphere at height h of a plane.

    With r^2 = h^2 + s^2, s ds = r dr: F = 2 pi E int_h^R (1 - r / R) r dr
    = 2 pi E ((R^2 - h^2) / 2 - (R^3 - h^3) / (3 R)).
    """
    force = (radius**2 - h**2) / 2 - (radius**3 - h**3) / (3 * radius)
    return 2 * math.pi * E * force, math.pi * (radius**2 - h**2)


def test_sphere_on_a_half_space_converges_with_second_order():
    """Halving the edges of a sphere's mesh makes the errors of force and area four times less."""
    force, area = _sphere_on_plane(0.5, 0.35)
    errors = []
    for level in (2, 3, 4):
        sphere = compliant_sphere(0.5, E, level)
        # Turned, so that no row of the mesh's vertices lies in the plane by symmetry.
        patches = solve([sphere, rigid_half_space()], [at(z=0.35, R=_about_x(0.3)), at()])
        found_area, _, found, _ = _only(patches)
        errors.append((abs(found[2] - force) / force, abs(found_area - area) / area))
    errors = np.array(errors)
    assert (errors[-1] < 0.015).all()
    ratios = errors[:-1] / errors[1:]
    assert (ratios > 2.8).all()
    assert (ratios < 6.0).all()


def test_two_equal_spheres_meet_in_a_flat_patch():
    """Mirror images meet in the plane of symmetry, with the pressure that a rigid plane finds."""
    sphere, R = compliant_sphere(0.5, E, 3), _about_x(0.2)
    mirrored = compliant_sphere(0.5, E, 3)
    flip = np.diag([1.0, 1.0, -1.0])
    mirrored.vertices = mirrored.vertices @ R.T @ flip @ R
    mirrored.elements = mirrored.elements[:, [0, 2, 1, 3]]
    patches = solve([sphere, mirrored], [at(z=0.4, R=R), at(z=-0.4, R=R)])
    area, _, force, _ = _only(patches)
    on_plane = _only(solve([sphere, rigid_half_space()], [at(z=0.4, R=R), at()]))
    assert area == pytest.approx(on_plane[0], rel=1e-10)
    assert force == pytest.approx(on_plane[2], rel=1e-10, abs=1e-6)
    assert patches.vertices_W[:, 2] == pytest.approx(0.0, abs=1e-12)
    assert patches.normals_W == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(patches.areas), 1)))


def test_harder_side_gives_way_less():
    """Slabs of modulus E and 3 E on each other: the surface is where E x = 3 E y, x + y = d."""
    d, half = 0.08, np.array([1.0, 1.0, 0.5])
    lower, upper = slab(half, E, cells=2), slab(half, 3.0 * E, cells=2)
    turned = at(0.3, 0.2, 1.0 - d, R=np.diag([1.0, -1.0, -1.0]))
    area, centroid, force, _ = _only(solve([lower, upper], [at(), turned]))
    # Within both: 1.7 x 1.8. The height is x = 3 d / 4 below the lower slab's top.
    assert area == pytest.approx(1.7 * 1.8, rel=1e-12)
    assert centroid[2] == pytest.approx(0.5 - 0.75 * d, rel=1e-12)
    assert force == pytest.approx([0.0, 0.0, -E * 0.75 * d * 1.7 * 1.8], rel=1e-12, abs=1e-8)


def test_rigid_box_in_a_compliant_half_space():
    """At depth d the slab presses with E d / H, also below its thickness H."""
    half = np.array([0.2, 0.3, 2.0])
    for d in (0.1, 2.5):
        bodies = [rigid_box(half), compliant_half_space(E, 2.0)]
        area, _, force, _ = _only(solve(bodies, [at(z=half[2] - d), at()]))
        assert area == pytest.approx(0.24 + 2.0 * d, rel=1e-12)
        assert force == pytest.approx([0.0, 0.0, 0.24 * E * d / 2.0], rel=1e-12, abs=1e-8)


def test_rigid_sphere_floats_on_a_compliant_half_space():
    """Hydrostatic pressure: the force is E / H times the volume of the mesh below the plane.

    The volume of a mesh's part below z = 0 is -int z n_z dA over that part (divergence theorem),
    which tends to that of the cap, pi d^2 (R - d / 3), with second order.
    """
    d, errors = 0.2, []
    cap = math.pi * d * d * (1.0 - d / 3.0)
    for level in (2, 3, 4):
        pose = at(z=1.0 - d, R=_about_x(0.3))
        patches = solve([compliant_half_space(E, 1.0), rigid_sphere(1.0, level)], [at(), pose])
        force = _only(patches)[2]
        errors.append(abs(-force[2] - E * cap) / (E * cap))
        assert abs(force[:2]).max() < 0.02 * E * cap
    assert errors[-1] < 0.025
    assert all(2.8 < a / b < 6.0 for a, b in itertools.pairwise(errors))


def test_compliant_half_space_and_compliant_box_are_springs_in_series():
    """The plateau's pressure p has p (a / E_box + H / E_half_space) = d."""
    d, stiff = 0.1, 3.0 * E
    bodies = [compliant_box(np.ones(3), E), compliant_half_space(stiff, 0.5)]
    patches = solve(bodies, [at(z=1.0 - d), at()])
    p = d / (1.0 / E + 0.5 / stiff)
    assert patches.pressure.max() == pytest.approx(p, rel=1e-12)
    lowest = patches.vertices_W[patches.pressure > (1.0 - 1e-9) * p]
    assert lowest[:, 2] == pytest.approx(-p * 0.5 / stiff, rel=1e-9)


def test_moment_of_a_pressure_gradient():
    """A slab's pressure grows along its axis; cut obliquely, it has a slope on the cut.

    With the slab turned over and tilted by a, p on the plane is p_c + g y with
    g = E / H sin(a). The cut is a rectangle 2 wide and l = 2 / cos(a) long, so the moment about
    its centre is, by the second moment of a rectangle, g 2 l^3 / 12.
    """
    angle, half = 0.1, np.array([1.0, 1.0, 2.0])
    # The slab's top looks down: it is turned by pi about x, then tilted; the plane cuts its walls.
    R = _about_x(math.pi + angle)
    patches = solve([slab(half, E, cells=3), rigid_half_space()], [at(z=1.5, R=R), at()])
    area, _, force, moment = _only(patches)
    # The cut goes across the walls y = +-1 of the slab: 2 wide and 2 / cos(angle) long.
    length = 2.0 / math.cos(angle)
    assert area == pytest.approx(2.0 * length, rel=1e-12)
    slope = E / 4.0 * math.sin(angle)  # the gradient E / H along the slab's axis, seen along y
    p_c = E / 4.0 * (2.0 - 1.5 / math.cos(angle))
    assert abs(force[2]) == pytest.approx(p_c * area, rel=1e-12)
    assert abs(moment[0]) == pytest.approx(slope * 2.0 * length**3 / 12.0, rel=1e-11)
    assert moment[1:] == pytest.approx([0.0, 0.0], abs=1e-7)
