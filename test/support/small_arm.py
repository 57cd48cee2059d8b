"""An arm of two links that turn about z, in a plane, and a cell with a wall for it."""

LINK = """
  <link name="{name}">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></collision>
    <visual><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></visual>
  </link>"""
ARM = f"""<robot name="arm">
  <link name="base"/>{LINK.format(name="upper")}{LINK.format(name="lower")}
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="0.6 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="2"/>
  </joint>
</robot>"""
"""URDF."""
CELL = """version: 1
sources: [{name: cell}]
robots: [{name: arm, urdf: arm.urdf}]
geometries:
  - {name: wall, source: cell, pose: {xyz: [2, 0, 0]}, shape: {type: box, size: [0.1, 2, 1]}}
"""
"""A scene file beside ``arm.urdf``."""
