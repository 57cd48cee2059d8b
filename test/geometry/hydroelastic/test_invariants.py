"""What must hold of contact surfaces in any pose: laws, invariance, continuity, hard cases."""

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
    star,
)
import numpy as np
import pytest
from surface_checks import check_patches

E = 1e6


def _rotation(rng):
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.sign(np.linalg.det(Q))


def _posed(rng, reach=0.2):
    return at(*rng.uniform(-reach, reach, 3), R=_rotation(rng))


PAIRS = {
    "volumes": (compliant_sphere(0.3, E, 1), compliant_box(np.array([0.2, 0.3, 0.25]), 3 * E)),
    "rigid box": (compliant_sphere(0.3, E, 1), rigid_box(np.array([0.2, 0.3, 0.25]))),
    "rigid sphere": (compliant_box(np.array([0.2, 0.3, 0.25]), E), rigid_sphere(0.3, 1)),
    "rigid floor": (compliant_sphere(0.3, E, 1), rigid_half_space()),
    "soft floor": (compliant_box(np.array([0.2, 0.3, 0.25]), E), compliant_half_space(E, 0.2)),
    "rigid on soft floor": (rigid_sphere(0.3, 1), compliant_half_space(E, 0.2)),
}


@pytest.fixture(params=list(PAIRS))
def pair(request):
    """Two bodies of kinds that have a contact surface."""
    return PAIRS[request.param]


def _moment_about_origin(total):
    return total[7:10] + np.cross(total[1:4], total[4:7])


@pytest.mark.parametrize("seed", range(3))
def test_order_of_registration_turns_force_and_normals_round(pair, seed):
    """With M and N exchanged areas stay, normals, forces and moments are the opposite."""
    rng = np.random.default_rng(seed)
    poses = [_posed(rng), _posed(rng)]
    one, two = solve(pair, poses), solve(pair[::-1], poses[::-1])
    assert len(one.rows) == len(two.rows) == 1
    a, b = one.totals[0], two.totals[0]
    size = one.areas @ one.face_pressure
    assert a[0] == pytest.approx(b[0], rel=1e-9)
    assert a[1:4] == pytest.approx(b[1:4], abs=1e-9)
    assert a[4:7] == pytest.approx(-b[4:7], abs=1e-9 * size)
    assert a[7:10] == pytest.approx(-b[7:10], abs=1e-9 * size)
    mean_one = one.areas @ one.normals_W
    assert mean_one == pytest.approx(-two.areas @ two.normals_W, abs=1e-9)


@pytest.mark.parametrize("distance", [0.0, 1e3, 1e6])
def test_moving_the_world_moves_the_surface(pair, distance):
    """A rigid motion of both bodies moves areas, forces and moments along, to its rounding."""
    rng = np.random.default_rng(11)
    poses = [_posed(rng), _posed(rng)]
    X = at(*(distance * np.array([0.6, -0.8, 0.5])), R=_rotation(rng))
    before, after = solve(pair, poses), solve(pair, [X @ pose for pose in poses])
    check_patches(before)
    check_patches(after)
    a, b, R = before.totals[0], after.totals[0], X[:3, :3]
    # The bodies' relative pose is known to the rounding of their places.
    rounding = 1e-10 + 1e-15 * distance / 0.3 * 100.0
    size = before.areas @ before.face_pressure
    assert b[0] == pytest.approx(a[0], rel=rounding)
    moved = R @ a[1:4] + X[:3, 3]
    assert b[1:4] == pytest.approx(moved, rel=1e-15, abs=rounding)
    assert b[4:7] == pytest.approx(R @ a[4:7], abs=rounding * size)
    assert b[7:10] == pytest.approx(R @ a[7:10], abs=rounding * size)


def test_normals_point_from_n_into_m(pair):
    """With M above N the normals of faces point up on the whole, and force pushes M up."""
    for bodies, sign in ((pair, 1.0), (pair[::-1], -1.0)):
        poses = [at(z=0.22), at()]
        patches = solve(bodies, poses if sign > 0 else poses[::-1])
        assert len(patches.rows) == 1
        assert sign * (patches.areas @ patches.normals_W)[2] > 0.0
        assert sign * patches.totals[0, 6] > 0.0


def test_triangles_and_polygons_are_the_same_surface(pair):
    """Dividing polygons changes no area, force or moment."""
    rng = np.random.default_rng(4)
    poses = [_posed(rng), _posed(rng)]
    triangles, polygons = solve(pair, poses, True), solve(pair, poses, False)
    check_patches(triangles)
    check_patches(polygons)
    assert triangles.totals == pytest.approx(polygons.totals, rel=1e-12, abs=1e-12)
    assert len(polygons.areas) <= len(triangles.areas)


def test_answers_are_repeatable(pair):
    """The same poses give the same bits, with other pairs asked before."""
    rng = np.random.default_rng(2)
    poses = [_posed(rng), _posed(rng)]
    first = solve(pair, poses)
    solve(pair, [_posed(rng), _posed(rng)])
    second = solve(pair, poses)
    for name in first.NAMES:
        assert np.array_equal(getattr(first, name), getattr(second, name))


def test_many_pairs_at_once_are_as_one_by_one():
    """A scene's surfaces are those of its pairs alone, also where the scratch memory grows."""
    rng = np.random.default_rng(6)
    bodies = [compliant_sphere(0.3, E, 1), rigid_box(np.array([0.2, 0.3, 0.25]))] * 4
    poses = [_posed(rng, 0.1) for _ in bodies]
    pairs = [(i, j) for i, j in itertools.combinations(range(8), 2) if i % 2 == 0 or j % 2 == 0]
    together = solve(bodies, poses, True, pairs)
    assert len(together.rows) == len(pairs)
    for s, (i, j) in enumerate(pairs):
        alone = solve([bodies[i], bodies[j]], [poses[i], poses[j]])
        part = slice(together.face_start[s], together.face_start[s + 1])
        assert np.array_equal(alone.areas, together.areas[part])
        assert np.array_equal(alone.totals[0], together.totals[s])


def _force(bodies, poses):
    patches = solve(bodies, poses)
    check_patches(patches)
    return patches.totals[0, 4:7] if len(patches.rows) else np.zeros(3)


@pytest.mark.parametrize(
    ("bodies", "touching"),
    [
        ((compliant_box(np.ones(3), E), rigid_half_space()), 1.0),
        ((compliant_box(np.ones(3), E), compliant_half_space(E, 1.0)), 1.0),
        ((compliant_box(np.ones(3), E), rigid_box(np.full(3, 0.5))), 1.5),
        ((compliant_box(np.ones(3), E), compliant_box(np.full(3, 0.5), E)), 1.5),
        ((rigid_box(np.ones(3)), compliant_half_space(E, 1.0)), 1.0),
        ((compliant_sphere(1.0, E, 1), compliant_sphere(1.0, E, 1)), 2.0),
    ],
)
def test_force_grows_from_nothing(bodies, touching):
    """Make and break: no force at or before touching, then one that grows without a jump.

    The faces are of size 4 and the stiffness per area at most E per metre, so the force at depth
    d is at most 4 E d.
    """
    for gap in (0.0, 1e-15, 1e-9, 0.1):
        assert _force(bodies, [at(z=touching + gap), at()]) == pytest.approx([0, 0, 0], abs=0.0)
    last = 0.0
    for depth in np.geomspace(1e-10, 0.05, 14):
        force = _force(bodies, [at(z=touching - depth), at()])
        assert last <= force[2] <= 4.0 * E * (depth + 1e-15)  # touching itself is rounded
        last = force[2]
    assert last > 0.0


def test_force_is_continuous_while_sliding(pair):
    """Small steps change the force by little: at most stiffness times the step.

    All sizes are below 0.3: the cut's area is below 1 and its outline below 4 m; the pressure's
    slope is at most 3 E / 0.2 per metre; a step of s changes the force by less than
    (1 . 15 E + 4 . 3 E) s < 30 E s.
    """
    step, last = 1e-5, None
    direction = np.array([0.5, 0.7, -0.4])
    for k in range(40):
        pose = at(*(np.array([0.02, 0.01, 0.25]) + k * step * direction), R=np.eye(3))
        force = _force(pair, [pose, at()])
        if last is not None:
            assert np.linalg.norm(force - last) < 30.0 * E * step
        last = force


# Hard cases.


def test_touching_faces_have_no_surface():
    """Coplanar faces that touch from outside are not in contact, in either order."""
    box, other = compliant_box(np.ones(3), E), compliant_box(np.array([0.5, 0.6, 1.0]), E)
    stiff = rigid_box(np.array([0.5, 0.6, 1.0]))
    for pair in ((box, other), (other, box), (box, stiff), (stiff, box)):
        for x in (0.0, 0.5, 1.0):
            assert len(solve(pair, [at(), at(x=x, z=2.0)]).rows) == 0
    assert len(solve([box, rigid_half_space()], [at(z=1.0), at()]).rows) == 0
    assert len(solve([box, compliant_half_space(E, 1.0)], [at(z=1.0), at()]).rows) == 0
    assert len(solve([stiff, compliant_half_space(E, 1.0)], [at(z=1.0), at()]).rows) == 0


@pytest.mark.parametrize("cells", [1, 2, 4])
def test_plane_along_inner_faces_counts_them_once(cells):
    """A rigid plane or box face that lies in inner faces of a mesh has its area once.

    The slab of ``cells`` columns has inner faces in the planes x = 0 (for even ``cells``) and in
    its diagonals; each cut has the area 2 . 1, or the diagonal's, times the height.
    """
    half = np.array([1.0, 1.0, 0.5])
    body = slab(half, E, cells)
    c = math.sqrt(0.5)
    sideways = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # z axis to +x
    diagonal = np.array([[c, 0.0, c], [c, 0.0, -c], [0.0, 1.0, 0.0]])
    diagonal = diagonal * np.sign(np.linalg.det(diagonal))
    for R, area in ((sideways, 2.0), (diagonal, 2.0 * math.sqrt(2.0))):
        patches = solve([body, rigid_half_space()], [at(), at(R=R)])
        check_patches(patches)
        assert patches.totals[0, 0] == pytest.approx(area, rel=1e-12)
    # The face x = 0 of a large rigid box, looking along +x.
    patches = solve([body, rigid_box(np.array([3.0, 3.0, 3.0]))], [at(), at(x=-3.0)])
    assert patches.totals[0, 0] == pytest.approx(2.0, rel=1e-12)


def test_identical_bodies_on_top_of_each_other():
    """Equal fields everywhere have no surface of equal pressure; a hair beside, all is finite."""
    rng = np.random.default_rng(9)
    for body in (compliant_box(np.ones(3), E), compliant_sphere(1.0, E, 1), slab(np.ones(3), E)):
        for pose in (at(), at(3.0, -2.0, 5.0, R=_rotation(rng))):
            patches = solve([body, body], [pose, pose])
            check_patches(patches)
            assert patches.areas.sum() == 0.0
        for shift in (1e-15, 1e-12, 1e-9, 1e-6, 1e-3):
            patches = solve([body, body], [at(), at(z=shift)])
            check_patches(patches)
        check_patches(solve([body, body], [at(), at(R=_rotation(rng))]))


def test_rigid_copy_of_the_surface_itself():
    """A rigid surface that coincides with a compliant body's has its area, without pressure."""
    box = np.array([0.5, 0.4, 0.3])
    patches = solve([compliant_box(box, E), rigid_box(box)], [at(), at()])
    check_patches(patches)
    assert patches.areas.sum() == 0.0 or patches.pressure.max() < 1e-6 * E


@pytest.mark.parametrize("ratio", [1e-3, 1e-6])
@pytest.mark.parametrize("order", [1, -1])
def test_huge_ratio_of_scales(ratio, order):
    """A tiny box in the face of a large one: p = E d / H there, on its tiny bottom.

    H is 1, the height of the large box. Coordinates of its size are rounded by 1e-16, so those
    of a box of 1e-6 are good to 1e-10, and areas and depths to less than the 1e-4 asked for.
    """
    half = np.array([1.0, 1.0, 0.5])
    tiny = rigid_box(np.full(3, ratio))
    d = 0.5 * ratio
    bodies, poses = [slab(half, E, 2), tiny], [at(), at(0.3, 0.1, 0.5 + ratio - d)]
    patches = solve(bodies[::order], poses[::order])
    check_patches(patches)
    bottom = 4.0 * ratio * ratio
    assert patches.totals[0, 6] == pytest.approx(-order * E * d * bottom, rel=1e-4)
    assert patches.totals[0, 0] == pytest.approx(bottom + 8.0 * ratio * d, rel=1e-4)
    soft = compliant_sphere(ratio, E, 1)
    patches = solve([slab(half, E, 2), soft][::order], poses[::order])
    check_patches(patches)
    assert patches.areas.sum() > 0.0


def test_deep_penetration():
    """A body wholly inside another has a finite surface, or none; a plane beyond it has none."""
    box, ball = compliant_box(np.ones(3), E), compliant_sphere(0.2, E, 1)
    for pose in (at(), at(0.1, 0.2, -0.3), at(0.75, 0.0, 0.0)):
        check_patches(solve([box, ball], [at(), pose]))
        check_patches(solve([box, rigid_sphere(0.2, 1)], [at(), pose]))
    assert len(solve([box, rigid_half_space()], [at(z=-1.5), at()]).rows) == 0


@pytest.mark.parametrize("depth", [1e-6, 1e-9, 1e-11])
def test_tiny_overlap(depth):
    """An overlap of micrometres to picometres has the pressure of its depth on its full area."""
    patches = solve(
        [slab(np.ones(3), E, 2), rigid_box(np.full(3, 0.5))], [at(), at(z=1.5 - depth)]
    )
    check_patches(patches)
    assert patches.totals[0, 6] == pytest.approx(-E * depth / 2.0, rel=1e-4)


def test_margin_counts_only_where_it_presses():
    """Negative pressure in a margin: the faces are there, the force is that of max(p, 0).

    The box of half extent 1 has the pressure -0.1 E on its faces and 0.9 E in its centre, so
    p = E (0.9 - |x|) is zero on the box of half extent 0.9. While only the layer around that is
    below a plane there is no force; at depth d of the inner box there is the frustum of pressure
    that this box has without a margin.
    """
    body = star(*_unit_box(), 1.0)
    body.pressure = np.where(np.abs(body.vertices).max(axis=1) > 0.5, -0.1 * E, 0.9 * E)
    body.margin = 0.1
    patches = solve([body, rigid_half_space()], [at(z=0.95), at()])
    check_patches(patches, has_margin=True)
    assert patches.totals[0, 0] == pytest.approx(4.0, rel=1e-12)
    assert patches.totals[0, 4:10] == pytest.approx(np.zeros(6), abs=0.0)
    assert patches.pressure.max() == pytest.approx(-0.05 * E, rel=1e-9)
    d = 0.07
    patches = solve([body, rigid_half_space()], [at(z=0.9 - d), at()])
    outer, plateau = 4.0 * 0.9**2, 4.0 * (0.9 - d) ** 2
    expected = E * d / 3.0 * (outer + plateau + math.sqrt(outer * plateau))
    assert patches.totals[0, 6] == pytest.approx(expected, rel=1e-12)
    assert patches.pressure.min() == pytest.approx(-0.1 * E, rel=1e-12)


def test_margin_of_a_compliant_half_space():
    """Its layer above z = 0 has faces with negative pressure, and no more above the margin."""
    floor, box = compliant_half_space(E, 1.0, margin=0.05), rigid_box(np.ones(3))
    patches = solve([floor, box], [at(), at(z=1.03)])
    check_patches(patches, has_margin=True)
    assert patches.pressure.min() == pytest.approx(-0.05 * E, rel=1e-9)
    assert patches.pressure.max() == pytest.approx(-0.03 * E, rel=1e-9)
    assert patches.totals[0, 4:7] == pytest.approx([0.0, 0.0, 0.0], abs=0.0)
    assert len(solve([floor, box], [at(), at(z=1.06)]).rows) == 0


def _unit_box():
    body = rigid_box(np.ones(3))
    return body.vertices, body.elements[:, :3]


@pytest.mark.parametrize("seed", range(4))
def test_random_poses_give_sound_surfaces(seed):
    """Random pairs of all kinds, among them aligned and grid poses: all faces are sound."""
    rng = np.random.default_rng(100 + seed)
    for bodies in PAIRS.values():
        for aligned in (False, True):
            R = np.eye(3)[:, rng.permutation(3)]
            R = R * np.linalg.det(R)
            grid = np.round(rng.uniform(-0.3, 0.3, 3), 1)
            pose = at(*grid, R=R) if aligned else _posed(rng, 0.3)
            check_patches(solve(bodies, [pose, at()], bool(seed % 2)))
