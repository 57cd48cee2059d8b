"""A ball on three rails among boxes in one mesh, and a checker of its collisions."""

from robot_scenes import diagram

from scene_graph_ros.planning import SceneGraphCollisionChecker

__all__ = ["gantry", "gantry_in"]

# A ball on three rails.
GANTRY = """<robot name="gantry"><link name="base"/><link name="x"/><link name="y"/>
  <link name="z"><collision><geometry><sphere radius="{radius}"/></geometry></collision></link>
  {joints}</robot>"""
RAIL = """<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{child}"/>
  <axis xyz="{axis}"/><limit lower="-1e9" upper="1e9"/></joint>"""


def gantry(case, folder, radius):
    """Return a checker of a ball whose configuration is its place in the mesh's frame."""
    mesh = case.mesh
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    return gantry_in("\n".join(lines), folder, radius, "{representation: triangles}")


def gantry_in(obj, folder, radius, properties):
    """Return such a checker for the text of an OBJ file, and properties of its mesh in YAML."""
    rails = [("x", "base", "1 0 0"), ("y", "x", "0 1 0"), ("z", "y", "0 0 1")]
    joints = [RAIL.format(name=f"to_{c}", parent=p, child=c, axis=a) for c, p, a in rails]
    (folder / "mesh.obj").write_text(obj)
    scene = f"""
geometries:
  - {{name: mesh, source: around, shape: {{type: mesh, file: {folder}/mesh.obj}},
     roles: {{proximity: {{mesh: {properties}}}}}}}
"""
    urdf = GANTRY.format(radius=radius, joints="".join(joints))
    return SceneGraphCollisionChecker(diagram(folder, urdf, scene))
