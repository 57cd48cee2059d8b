"""An arm of several shapes to a link, in a scene with a source of sensed geometry."""

from small_arm import ARM

from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, SceneGraph
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.scene_files import load_urdf, register_robot

__all__ = ["SensedCell"]

_LINK = """
  <link name="{name}">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></collision>
    <collision><origin xyz="0.1 0.1 0.1"/><geometry><sphere radius="0.06"/></geometry></collision>
    <collision><origin xyz="0.3 -0.1 0" rpy="1 0 0"/>
      <geometry><cylinder radius="0.05" length="0.2"/></geometry></collision>
  </link>"""


class SensedCell:
    """The arm, and geometries of ``sensor`` that stand still."""

    def __init__(self, tmp_path):
        file = tmp_path / "arm.urdf"
        links = ARM[: ARM.index('<link name="upper">')]
        joints = ARM[ARM.index('<joint name="shoulder"') :]
        file.write_text(links + _LINK.format(name="upper") + _LINK.format(name="lower") + joints)
        self.model = load_urdf(file)
        self.graph = SceneGraph()
        arm = self.graph.register_source("arm")
        self.frames = register_robot(self.model, self.graph, arm)
        self.sensor = self.graph.register_source("sensor")
        self.tree = self.model.kinematic_tree()

    def add(self, shape, X_WG, name):
        """Register a geometry that collides."""
        instance = GeometryInstance(X_WG, shape, name)
        instance.set_proximity_properties(ProximityProperties())
        return self.graph.register_anchored_geometry(self.sensor, instance)

    @property
    def robots(self):
        """The robots of ``context`` as it is now."""
        return RobotDiagram(self.graph, self.context, self.tree, self.frames)

    def new_checker(self, padding=0.0):
        """Return a checker of the geometries that are registered."""
        return SceneGraphCollisionChecker(self.robots, env_collision_padding=padding)
