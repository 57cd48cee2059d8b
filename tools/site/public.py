"""Which modules the API reference explains."""

__all__ = ["PUBLIC"]

PUBLIC = (
    "scene_graph_ros.geometry",
    "scene_graph_ros.geometry.accuracy",
    "scene_graph_ros.geometry.errors",
    "scene_graph_ros.geometry.tolerances",
    "scene_graph_ros.geometry.query.results",
    "scene_graph_ros.geometry.hydroelastic.contact_surface",
    "scene_graph_ros.geometry.deformable.results",
    "scene_graph_ros.geometry.meshes.volume_mesh",
    "scene_graph_ros.geometry.meshes.volume_io",
    "scene_graph_ros.geometry.model.collision_filter",
    "scene_graph_ros.geometry.model.paths",
    "scene_graph_ros.geometry.model.render_label",
    "scene_graph_ros.geometry.perception",
    "scene_graph_ros.geometry.optimization",
    "scene_graph_ros.robots",
    "scene_graph_ros.scene_files",
    "scene_graph_ros.planning",
    "scene_graph_ros.planning.trajectories",
    "scene_graph_ros.planning.certified",
    "scene_graph_ros.sensing",
    "scene_graph_ros.client",
    "scene_graph_ros.node.node",
)
"""What users import; adapters of messages come in addition."""
