"""A mesh file names libraries of its own folder or package, and none of elsewhere is read."""

import pytest

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.obj_look import obj_look

_OBJ = "mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
_MTL = "newmtl red\nKd 1 0 0\n"


@pytest.mark.parametrize("is_absolute", [False, True])
def test_a_library_outside_the_package_is_not_read(tmp_path, is_absolute):
    """So none can be handed on to who asks for the mesh's files."""
    folder = tmp_path / "meshes"
    folder.mkdir()
    secret = tmp_path / "secret.mtl"
    secret.write_text(_MTL)
    path = folder / "a.obj"
    path.write_text(_OBJ.format(library=secret if is_absolute else "../secret.mtl"))
    with pytest.warns(MeshColorWarning, match="lies outside"):
        look = obj_look(Mesh(path))
    assert look is not None and look.libraries == ()


def test_libraries_beside_and_in_the_package_are_read(tmp_path):
    """A package keeps them where it wants."""
    package = tmp_path / "package"
    for folder in ("meshes", "materials"):
        (package / folder).mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (package / "materials" / "red.mtl").write_text(_MTL)
    path = package / "meshes" / "a.obj"
    path.write_text(_OBJ.format(library="../materials/red.mtl"))
    look = obj_look(Mesh(path))
    assert look is not None
    assert [path.name for path, _ in look.libraries] == ["red.mtl"]
