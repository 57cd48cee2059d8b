"""The errors of proofs of regions."""

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["CertificateError"]


class CertificateError(SceneGraphError, ValueError):
    """Robots, shapes or regions that a proof cannot be about; the message names the argument."""
