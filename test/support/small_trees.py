"""Small robots: an arm with a jaw that mimics, and bodies that float and roll."""

from scene_graph_ros.scene_files import load_kinematic_tree

ARM = """<robot name="arm"><link name="base"/><link name="upper"/><link name="lower"/>
  <link name="tip"/><link name="jaw"/><link name="nail"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="2 0 0"/><axis xyz="0 0 2"/><limit lower="-1" upper="2"/></joint>
  <joint name="slide" type="prismatic"><parent link="lower"/><child link="tip"/>
    <origin xyz="1 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5"/></joint>
  <joint name="jaw" type="prismatic"><parent link="lower"/><child link="jaw"/>
    <axis xyz="0 1 0"/><limit lower="-0.1" upper="9"/><mimic joint="slide" multiplier="-3"
    offset="0.5"/></joint>
  <joint name="nail" type="prismatic"><parent link="base"/><child link="nail"/>
    <axis xyz="0 0 1"/><limit lower="-9" upper="9"/><mimic joint="jaw" multiplier="2"/></joint>
</robot>"""


LOOSE = """<robot name="loose"><link name="a"/><link name="b"/><link name="c"/>
  <joint name="free" type="floating"><parent link="a"/><child link="b"/>
    <origin xyz="0 0 1" rpy="0.3 -0.2 0.9"/></joint>
  <joint name="floor" type="planar"><parent link="b"/><child link="c"/>
    <origin xyz="1 0 0" rpy="0.1 0.5 0"/><axis xyz="0.48 0.6 0.64"/></joint></robot>"""


def arm():
    """Return the tree of an arm in the xy-plane with a sliding tip, and a jaw that mimics."""
    return load_kinematic_tree(ARM)
