"""Installation of the ament_python package, as `colcon build` runs it."""

from importlib.metadata import version
from pathlib import Path

from setuptools import find_packages, setup

NAME = "scene_graph_ros"


def shared(folder: str) -> list[tuple[str, list[str]]]:
    """List the files below ``folder`` with where they go in the package's share folder."""
    parents = sorted({path.parent for path in Path(folder).rglob("*") if path.is_file()})
    return [
        (f"share/{NAME}/{parent}", sorted(str(p) for p in parent.iterdir() if p.is_file()))
        for parent in parents
        if parent.name != "__pycache__"
    ]


# A wheel that brings kernels along is for the numba that compiled them.
HAS_KERNELS = any(Path(NAME, "kernels").glob("*.pack"))

setup(
    name=NAME,
    version="0.1.0",
    description="A geometry world for ROS 2: robots publish poses, queries answer.",
    license="Apache-2.0",
    maintainer="scene_graph_ros maintainers",
    maintainer_email="maintainers@scene-graph-ros.invalid",
    # Two packages, named explicitly: tests and tools are not installed.
    packages=find_packages(include=[NAME, f"{NAME}.*", "msg_adapters", "msg_adapters.*"]),
    package_data={
        NAME: ["py.typed", "kernels/*.pack"],
        "msg_adapters": ["py.typed"],
        f"{NAME}.node": ["*.xml"],
        f"{NAME}.views.browser": ["page/*"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *shared("launch"),
        *shared("config"),
    ],
    python_requires=">=3.11,<3.15",  # what the core has wheels for
    install_requires=[
        *([] if HAS_KERNELS else ["setuptools"]),  # colcon asks for it, nothing at run time does
        "manifold3d",
        "meshio",
        f"numba=={version('numba')}" if HAS_KERNELS else "numba",
        "numpy",
        "pydantic>=2",
        "pyyaml",
        "scipy",
        "tqdm",
        "trimesh",
        "websockets>=14",
    ],
    extras_require={
        "coacd": ["coacd"],
        "draco": ["DracoPy"],
        "fcl": ["python-fcl"],
        "graphs": ["clarabel"],
        "mixed-integer": ["pyscipopt"],
        "ompl": ["ompl"],
        "optimal-control": ["casadi"],
        "pandas": ["pandas"],
        "recording": ["rosbags"],
        # To run the node where ROS comes as wheels.
        "ros": [
            "ros-common-interfaces==5.3.6",
            "ros-domain-coordinator==0.12.0",
            "ros-lifecycle-msgs==2.0.3",
            "ros-rclpy==7.1.6",
            "ros-rmw-fastrtps-cpp==8.4.3",
        ],
        "ruckig": ["ruckig"],
        "scs": ["scs"],
        "test": ["hypothesis", "pytest"],
        "tetrahedra": ["pytetwild"],
        "toppra": ["toppra"],
    },
    entry_points={"console_scripts": ["scene_graph_node = scene_graph_ros.node.main:main"]},
    zip_safe=False,
)
