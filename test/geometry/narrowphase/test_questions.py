"""Every kind of core answers every question, and what it answers fits its support function.

Each answer is asked by itself, also those of a kind that only the tests have. Compiled, that would
be some two hundred functions for nothing else; so it is done where nothing is compiled.
"""

import os
from types import ModuleType

from cores_of_kinds import CORES, NO_HULLS
import numpy as np
import pytest
import truncated_cone

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, store_lanes
from scene_graph_ros.geometry.narrowphase.cores import kinds, registry
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.features import (
    FACE,
    feature_support,
    LINE,
    NONE,
    RIM,
    SMOOTH,
    VERTEX,
)
from scene_graph_ros.geometry.narrowphase.multistart.all_features import CANDIDATES
from scene_graph_ros.geometry.narrowphase.pair import A_SIDE, Placed, Simplex
from scene_graph_ros.geometry.narrowphase.prove import growth as growth_of_pairs

CONE = (7, -1, 0.0, (0.1, 0.25, 0.2, *np.zeros(6)))
ALL = {name: (registry.FILES[core[0]], core, hulls) for name, (core, hulls) in CORES.items()}
ALL["truncated cone"] = (truncated_cone, CONE, NO_HULLS)
SIZE = 0.5
TIE = 1e-14

one_by_one = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") != "1",
    reason="answers are asked one by one where nothing is compiled (`make test` does)",
)
each_kind = pytest.mark.parametrize("name", ALL)


def directions(count=40):
    """Return unit vectors: random ones, and the axes both ways."""
    n = np.random.default_rng(5).normal(size=(count, 3))
    n = np.vstack([n, np.eye(3), -np.eye(3)])
    return n / np.linalg.norm(n, axis=1)[:, None]


def stacked(lanes):
    """Return the numbers of several lanes, (k, LANES)."""
    room = np.zeros((len(lanes), LANES))
    for k, x in enumerate(lanes):
        store_lanes(room, LANES * k, x)
    return room


class Asked:
    """A core, and what its file answers."""

    def __init__(self, name):
        self.file, self.core, self.hulls = ALL[name]
        self.placed = Placed(self.core, IDENTITY, ORIGIN)

    def support(self, d):
        """Return a support point."""
        point, _ = self.file.support(self.core, self.hulls, tuple(map(float, d)))
        return np.array(point)

    def extent(self, d):
        """Return the support function at d."""
        return float(np.dot(self.support(d), d))

    def holds(self, x):
        """Return whether no direction shows that the point x is outside."""
        return all(np.dot(x, d) <= self.extent(d) + TIE for d in directions())

    def simplex(self, d):
        """Return the simplex that is the support point along d."""
        S, ids, lam = np.zeros((4, 9)), np.zeros((4, 2), np.int64), np.array([1.0, 0.0, 0.0, 0.0])
        point, index = self.file.support(self.core, self.hulls, tuple(map(float, d)))
        S[0, 3:6], ids[0, 0] = point, index
        return Simplex(S, ids, lam, 1)

    def planes_of_lanes(self, count):
        """List so many planes or faces, (normal, offset), by ``lane_planes``."""
        rows = []
        for first in range(0, count, LANES):
            normals, offsets = self.file.lane_planes(self.core, self.hulls, first)
            rows += zip(stacked(normals).T, stacked([offsets])[0], strict=True)
        assert all(offset == np.inf for _, offset in rows[count:])
        return rows[:count]

    def vertices_of_lanes(self, count):
        """List so many vertices by ``lane_vertices``."""
        rows = [
            stacked(self.file.lane_vertices(self.core, self.hulls, first)).T
            for first in range(0, count, LANES)
        ]
        assert all((row[count % LANES :] == row[-1]).all() for row in rows[-1:] if count % LANES)
        return list(np.vstack(rows)[:count]) if rows else []

    def candidates(self, d):
        """List all candidates along d."""
        simplex, found = self.simplex(d), []
        for k in range(CANDIDATES):
            feature = self.file.candidate(self.placed, self.hulls, simplex, A_SIDE, tuple(d), k)
            if feature[0] != NONE:
                found.append(feature)
        return found

    def reach(self, feature, d):
        """Return how far the feature reaches along d: a line without a radius by its ends."""
        if feature[0] == LINE and feature[3] == 0.0:
            ends = [np.add(feature[1], np.multiply(s, feature[2])) for s in feature[4:6]]
            return max(float(np.dot(end, d)) for end in ends)
        return float(np.dot(feature_support(feature, self.core, IDENTITY, tuple(d)), d))


def test_every_kind_answers_every_question():
    """By a function of its own file, or one that it takes by name from another."""
    assert len(registry.QUESTIONS) > 20
    assert len(set(registry.QUESTIONS)) == len(registry.QUESTIONS)
    for file, _, _ in ALL.values():
        assert set(registry.QUESTIONS) <= set(file.__all__)


def test_a_kind_without_an_answer_is_an_error_when_the_question_is_made(monkeypatch):
    """Never the answer of another kind."""
    monkeypatch.setitem(registry.FILES, 8, ModuleType("cores.torus"))
    monkeypatch.setattr(registry, "QUESTIONS", [])

    def support(core, hulls, d):
        """Be asked."""

    with pytest.raises(NotImplementedError, match=r"kind 'torus' has no answer to 'support'"):
        registry.asked(inlined_kernel)(support)


@one_by_one
@each_kind
def test_support_points_are_furthest_and_lanes_agree(name):
    """No other support point lies further; eight directions at once find points as far."""
    asked = Asked(name)
    every = directions(42)  # six times eight, with the axes
    points = np.array([asked.support(d) for d in every])
    assert (points @ every.T <= np.einsum("ij,ij->i", points, every) + TIE).all()
    for first in range(0, len(every), LANES):
        room = np.zeros((6, LANES))
        room[:3] = every[first : first + LANES].T
        d = tuple(load_lanes(room, k * LANES) for k in range(3))
        for k, x in enumerate(asked.file.lane_support(asked.core, asked.hulls, d)):
            store_lanes(room, (3 + k) * LANES, x)
        expected = [asked.extent(d) for d in room[:3].T]
        np.testing.assert_allclose((room[:3] * room[3:]).sum(0), expected, rtol=0.0, atol=1e-15)


@one_by_one
@each_kind
def test_inner_balls_are_inside(name):
    """The ball touches at the support point, and reaches no further than the core."""
    asked = Asked(name)
    for d in directions():
        q = asked.support(d)
        r = asked.file.inner_radius(asked.core, asked.hulls, tuple(q), tuple(d))
        assert r >= 0.0
        assert all(np.dot(q - r * d, e) + r <= asked.extent(e) + TIE for e in directions())


@one_by_one
@each_kind
def test_growth_is_a_lower_bound(name):
    """The support function around m is at least what the growth says within the reach."""
    asked = Asked(name)
    rng = np.random.default_rng(6)
    for m in directions():
        q = asked.support(m)
        t = np.cross(m, (1.0, 0.0, 0.0) if abs(m[0]) < 0.9 else (0.0, 1.0, 0.0))
        t /= np.linalg.norm(t)
        u = np.cross(m, t)
        known = asked.file.growth(
            asked.core, asked.hulls, *map(tuple, (q, m, t, u)), TIE * SIZE, TIE * SIZE
        )
        for reach in (0.1, 1.0):
            tt, tu, uu = growth_of_pairs._form(known, reach)
            for x, y in rng.uniform(-0.7, 0.7, (20, 2)) * reach:
                bound = q @ (m + x * t + y * u) + tt * x * x + 2.0 * tu * x * y + uu * y * y
                assert asked.extent(m + x * t + y * u) >= bound - TIE


@one_by_one
@each_kind
def test_planes_faces_and_edges_bound_the_core(name):
    """Each plane and each face is as far as the core reaches; an edge lies on both its faces."""
    asked = Asked(name)
    file, core, hulls = asked.file, asked.core, asked.hulls
    planes = [file.plane_of(core, hulls, k) for k in range(file.plane_count(core, hulls))]
    faces = asked.planes_of_lanes(file.face_count(core, hulls))
    for of_lanes, (n, offset) in zip(asked.planes_of_lanes(len(planes)), planes, strict=True):
        np.testing.assert_allclose(of_lanes[0], n, rtol=0.0, atol=1e-15)
        assert of_lanes[1] == offset
    for n, offset in planes + faces:
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=TIE)
        assert offset == pytest.approx(asked.extent(n), abs=1e-14)
    for k, axis in enumerate(np.eye(3)):
        if file.has_plane_across(core, k):
            normals = [n for n, _ in planes]
            assert {1.0, -1.0} <= {round(float(np.dot(n, axis)), 12) for n in normals}
    for k in range(file.edge_count(core, hulls)):
        one, other, v = file.edge_of(asked.placed, hulls, k)
        assert one != other
        for n, offset in (faces[one], faces[other]):
            assert np.dot(n, v) == pytest.approx(offset, abs=1e-14)
        line = file.edge_feature(asked.placed, hulls, k)
        assert line[0] == LINE
        assert all(asked.holds(np.add(line[1], np.multiply(s, line[2]))) for s in line[4:6])
    corners = [file.local_vertex(core, hulls, k) for k in range(file.vertex_count(core, hulls))]
    np.testing.assert_array_equal(asked.vertices_of_lanes(len(corners)), corners)
    for d in directions() if corners else ():
        assert max(np.dot(x, d) for x in corners) == pytest.approx(asked.extent(d), abs=TIE)


@one_by_one
@each_kind
def test_what_a_core_says_of_itself(name):
    """Whether it is round or a list, and its side."""
    asked = Asked(name)
    file, core, hulls = asked.file, asked.core, asked.hulls
    indices = {file.support(core, hulls, tuple(d))[1] for d in directions()}
    assert file.is_curved(core) == (indices == {kinds.CURVED})
    assert file.is_listed(core) == (name in ("hull", "small hull"))
    assert file.is_simple(core, hulls) or file.is_listed(core)
    assert file.corner_ways(core, hulls) in {
        kinds.CORNERS_UNKNOWN,
        kinds.CORNERS_NOWHERE,
        kinds.CORNERS_ACROSS_SIDE,
        kinds.CORNERS_OF_ELLIPSOID,
    }
    if file.edge_count(core, hulls):
        assert file.corner_ways(core, hulls) == kinds.CORNERS_NOWHERE
    side = file.side(asked.placed)
    assert side[0] in (LINE, NONE)
    if side[0] == LINE:
        assert all(asked.extent(d) == pytest.approx(side[3]) for d in np.eye(3)[:2])


@one_by_one
@each_kind
def test_features_reach_as_far_as_the_core(name):
    """What is touched along d, what a simplex suggests, and one of the candidates."""
    asked = Asked(name)
    file, placed, hulls = asked.file, asked.placed, asked.hulls
    for d in directions():
        expected = pytest.approx(asked.extent(d), abs=1e-14)
        touched = file.touched(placed, hulls, tuple(d), 0.0)
        assert touched[0] in (VERTEX, LINE, RIM, SMOOTH)
        assert asked.reach(touched, d) == expected
        suggested = file.feature_at(placed, asked.simplex(d), A_SIDE, tuple(map(float, d)))
        assert asked.reach(suggested, d) == expected
        candidates = asked.candidates(d)
        assert max(asked.reach(feature, d) for feature in candidates) == expected
        for feature in candidates:
            a = tuple(asked.support(d))
            after = file.neighbor(placed, hulls, feature, a, tuple(d), 1e-15)
            assert after[0] in (VERTEX, LINE, RIM, FACE, SMOOTH, NONE)


@one_by_one
@each_kind
def test_points_are_moved_onto_features(name):
    """A far point of a line or a face ends on the core; the feature's own point stays."""
    asked = Asked(name)
    for d in directions():
        simplex = asked.simplex(d)
        for feature in asked.candidates(d):
            if feature[0] not in (LINE, FACE) or (feature[3] > 0.0 and feature[0] == LINE):
                continue
            if feature[4] > 0.0 and feature[0] == FACE:
                continue  # a hull's face: its polygon is looked at by `all_features`
            for s in (-3.0, 0.0, 3.0):
                along = feature[2] if feature[0] == LINE else np.cross(feature[2], d + 0.1)
                a = tuple(map(float, np.add(feature[1], np.multiply(s * SIZE, along))))
                x = asked.file.clamp_to(asked.placed, feature, simplex, A_SIDE, a)
                assert asked.holds(x)
                if s == 0.0:
                    np.testing.assert_allclose(x, a, rtol=0.0, atol=1e-14)
