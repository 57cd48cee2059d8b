"""Meshes of real robots: what they mean by winding numbers, and their hulls."""

from mesh_distances import signed_distances
import numpy as np
import pytest
from robot_files import compared_sides, robot_meshes
from searching import times

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.sources import load_surface, surface_of
from scene_graph_ros.geometry.tables.shape_table import build_shape_table
from scene_graph_ros.scene_files.packages import find_package

SAMPLE = 20
"""Files in a run of all tests, drawn from those of a moderate size; `make search` has them all."""

LARGEST = 8
"""Files of 4 MB to 29 MB."""

MANY_PAIRS = 12_000_000
"""Solid angles that are computed of one of these: of 350 000 triangles at 68 points."""

MODERATE = 150_000
"""Bytes: such a file takes a tenth of a second."""

IN_DOUBT = ("parts can't be united", "a part that is folded and turned inside out")
"""Of the reports of meshes whose sides may be wrong, which says so."""

MOST_IN_DOUBT = 2
"""Files of all that have a wrong side and such a report."""


def sampled_files():
    """Return the files that are tried."""
    files = robot_meshes()
    if times(1) > 1:
        return files
    moderate = [file for file in files if file.stat().st_size < MODERATE]
    chosen = np.random.default_rng(4).permutation(len(moderate))[:SAMPLE]
    return [moderate[k] for k in chosen]


@pytest.mark.search
def test_meshes_of_robots_have_the_sides_of_their_winding_numbers():
    """By solid angles of the file's own triangles, joined and oriented by other code than ours."""
    rng = np.random.default_rng(4)
    compared = inside = in_doubt = 0
    for path in sampled_files():
        mesh = Mesh(path)
        try:
            vertices, triangles = load_surface(mesh)
            surface = surface_of(mesh)
        except MeshError:
            continue  # a file of the set has no vertices
        found = compared_sides(
            rng, surface, vertices, triangles, lambda q, mesh=mesh: signed_distances(mesh, q)
        )
        if len(found.wrong):
            assert any(words in str(surface.report) for words in IN_DOUBT), (
                path,
                found.wrong[0],
                str(surface.report),
            )
            in_doubt += 1
            continue
        compared, inside = compared + found.compared, inside + found.inside
    assert in_doubt <= MOST_IN_DOUBT
    assert compared >= 20 * SAMPLE
    assert inside >= SAMPLE


@pytest.mark.search
@pytest.mark.skipif(times(1) == 1, reason="takes minutes: a part of `make search`")
@pytest.mark.parametrize("number", range(LARGEST))
def test_largest_meshes_have_the_sides_of_their_winding_numbers(number):
    """At more points than others have: only few of these are near any detail."""
    path = sorted(robot_meshes(), key=lambda file: -file.stat().st_size)[number]
    mesh = Mesh(path)
    vertices, triangles = load_surface(mesh)
    surface = surface_of(mesh)
    found = compared_sides(
        np.random.default_rng(4),
        surface,
        vertices,
        triangles,
        lambda q: signed_distances(mesh, q),
        pairs=MANY_PAIRS,
    )
    assert not len(found.wrong), (path, found.wrong[0], str(surface.report))
    assert found.compared >= 20


def test_real_collision_meshes_are_read():
    """The Panda's and the UR5's collision meshes have hulls around all of their vertices."""
    root = find_package("example-robot-data") / "robots"
    files = sorted((root / "panda_description").rglob("collision/*.*"))
    files += sorted((root / "ur_description" / "meshes" / "ur5" / "collision").glob("*.*"))
    files = [f for f in files if f.suffix.lower() in (".stl", ".obj", ".dae")]
    assert len(files) > 10
    for file in files:
        table = build_shape_table([Mesh(file)], [True])
        hulls, surfaces = table.hulls, table.surfaces
        assert 0.01 < table.scale[0] < 2.0, file
        heights = surfaces.vertices @ hulls.face_normals.T - hulls.face_offsets
        assert heights.max() <= 1e-12 * table.scale[0], file
