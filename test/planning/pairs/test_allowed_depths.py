"""Overlaps that a negative padding allows: as deep as the scene's own query says, and no deeper.

Small bodies deep in large ones are where a ball or a box around a body tells least.
"""

import itertools

import numpy as np
import pytest
from robot_scenes import move
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    PointCloud,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.planning import EdgeStatus, RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.scene_files import load_urdf, register_robot

OCTAHEDRON = """v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1.5\nv 0 0 -1.5
f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6
"""
KINDS = {
    "sphere": lambda size, file: Sphere(size),
    "box": lambda size, file: Box(size, 2.5 * size, 2.0 * size),
    "capsule": lambda size, file: Capsule(0.5 * size, 2.0 * size),
    "cylinder": lambda size, file: Cylinder(size, 1.5 * size),
    "ellipsoid": lambda size, file: Ellipsoid(size, 0.4 * size, 2.0 * size),
    "hull": lambda size, file: Convex(file, size),
    "half space": lambda size, file: HalfSpace(),
    "cloud": lambda size, file: PointCloud([[0.0, 0.0, 0.0], [0.5 * size, 0.0, size]], 0.7 * size),
}
SIZES = 0.003, 0.02, 0.15
"""Metres: of bodies that move; those around them have the last."""
SMALL = list(itertools.product(list(KINDS)[:-2], SIZES))
PADDINGS = -1e-3, -0.005, -0.02, -0.1
CLOSE = 1e-9
"""Metres: what is nearer to the padding than this may be either."""
LINKS = [f"{kind}_{size}" for kind, size in SMALL]
SWARM = f"""<robot name="swarm"><link name="world"/><link name="body"/>
  {"".join(f'<link name="{each}"/>' for each in LINKS)}
  <joint name="free" type="floating"><parent link="world"/><child link="body"/></joint>
  {
    "".join(
        f'<joint name="{each}" type="fixed"><parent link="body"/><child link="{each}"/></joint>'
        for each in LINKS
    )
}</robot>"""


class Swarm:
    """Bodies of all kinds and sizes at one place, that fly together about a large one."""

    def __init__(self, folder, kind):
        (folder / "swarm.urdf").write_text(SWARM)
        (folder / "hull.obj").write_text(OCTAHEDRON)
        model, graph = load_urdf(folder / "swarm.urdf"), SceneGraph()
        source = graph.register_source("swarm")
        frames = register_robot(model, graph, source, all_links=True)

        def instance(name, kind, size):
            result = GeometryInstance(np.eye(4), KINDS[kind](size, folder / "hull.obj"), name)
            result.set_proximity_properties(ProximityProperties())
            return result

        ids = [
            graph.register_geometry(source, frames[link], instance(link, *each))
            for link, each in zip(LINKS, SMALL, strict=True)
        ]
        graph.register_anchored_geometry(source, instance("large", kind, SIZES[-1]))
        flying = GeometrySet([frames[link] for link in LINKS])
        graph.collision_filter_manager().apply(CollisionFilterDeclaration().exclude_within(flying))
        context = graph.create_default_context()
        self.robots = RobotDiagram(graph, context, model.kinematic_tree(), frames)
        self.place = {int(each): place for place, each in enumerate(ids)}
        self.checker = SceneGraphCollisionChecker(self.robots)

    def distances(self, q):
        """Return the signed distances ``(n, bodies)`` that the scene's queries tell."""
        result = np.full((len(q), len(SMALL)), np.nan)
        for row, each in zip(result, q, strict=True):
            for pair in move(self.robots, each).compute_signed_distance_pairwise_closest_points():
                place = self.place.get(int(pair.id_A), self.place.get(int(pair.id_B)))
                row[place] = pair.distance
        assert np.isfinite(result).all()
        return result

    def checkers(self):
        """Return (which body, padding, checker) for each body alone and each padding."""
        count, first = len(self.checker.bodies), self.checker.get_body(LINKS[0]).index
        for place in range(len(SMALL)):
            own, filters = first + place, np.ones((count, count))
            filters[own, -1] = filters[-1, own] = 0.0
            always = self.checker.get_filtered_collision_matrix() == -1
            checker = self.checker.clone()
            checker.set_collision_filter_matrix(np.where(always, -1, filters))
            for padding in PADDINGS:
                checker.set_padding_between(own, count - 1, padding)
                yield place, padding, checker


@pytest.fixture(scope="module", name="swarm", params=list(KINDS))
def _swarm(request, tmp_path_factory):
    return Swarm(tmp_path_factory.mktemp("swarm"), request.param)


def flights(seed, count):
    """Return configurations ``(count, 7)`` of bodies in a large one, and close by."""
    rng = np.random.default_rng(seed)
    turns = Rotation.random(count, random_state=rng).as_quat()[:, [3, 0, 1, 2]]
    return np.hstack([turns, rng.uniform(-0.2, 0.2, (count, 3))])


def test_configurations_are_free_where_no_overlap_is_too_deep(swarm):
    """And a clearance is the distance less the padding, where it is near enough."""
    q, seen = flights(1, 24), set()
    distances = swarm.distances(q)
    for place, padding, checker in swarm.checkers():
        beyond = distances[:, place] - padding
        sure = np.abs(beyond) > CLOSE
        free = checker.check_configs_collision_free(q)
        case = LINKS[place], padding
        assert (free == (beyond > 0.0))[sure].all(), case
        seen |= set(free.tolist())
        for row, found in enumerate(checker.calc_robot_clearances(q, 0.002)):
            is_near = beyond[row] <= 0.002
            assert len(found.distances) == is_near or abs(beyond[row] - 0.002) < CLOSE, case
            if len(found.distances):
                assert found.distances[0] == pytest.approx(beyond[row], abs=CLOSE), case
    assert seen == {False, True}


def test_edges_are_free_where_no_overlap_on_them_is_too_deep(swarm):
    """By what the scene's queries tell of samples."""
    ends, ratios = flights(2, 6), np.linspace(0.0, 1.0, 17)[:, np.newaxis]
    ends[:, 4:] *= 0.5
    ends[3:, :4] = ends[:3, :4]  # They keep their orientation: edges of quaternions are no lines.
    edges = np.stack([ends[:3], ends[3:]], axis=1)
    samples = [(1.0 - ratios) * edge[0] + ratios * edge[1] for edge in edges]
    least = np.stack([swarm.distances(each).min(axis=0) for each in samples])
    seen = set()
    for place, padding, checker in swarm.checkers():
        for edge, distance, found in zip(
            edges, least[:, place] - padding, checker.measure_edges(edges), strict=True
        ):
            case = LINKS[place], padding, distance
            seen.add(found.status)
            if distance < -CLOSE:
                assert found.status is EdgeStatus.COLLIDES, case
                deep = swarm.distances(found.configuration[np.newaxis])[0, place]
                assert deep - padding < CLOSE, case
            elif found.status is EdgeStatus.FREE:
                assert found.least_clearance <= distance + CLOSE, case
            assert checker.check_edge_collision_free(*edge) == found.completely_free, case
            if distance > 0.04:  # Farther than a sample is from the next.
                assert found.status is EdgeStatus.FREE, case
    assert {EdgeStatus.COLLIDES, EdgeStatus.FREE} <= seen
