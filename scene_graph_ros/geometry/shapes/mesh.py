"""A triangle mesh."""

from __future__ import annotations

import os
from typing import ClassVar

from numpy.typing import ArrayLike

from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape, Scale

__all__ = ["Mesh"]


class Mesh(MeshShape):
    """A triangle mesh, which need be neither convex nor closed.

    ``Mesh(path, scale=1.0)``, ``Mesh(vertices=, faces=)`` or
    ``Mesh(contents=data, file_type="obj")``. ``scale`` is a number or three; it may be negative.
    In point contact a mesh stands for its convex hull, unless its proximity properties say
    ``("mesh", "representation") = "triangles"``.
    """

    __slots__ = ()
    kind: ClassVar[ShapeKind] = ShapeKind.MESH

    def __init__(
        self,
        path: str | os.PathLike[str] | None = None,
        scale: Scale = 1.0,
        *,
        vertices: ArrayLike | None = None,
        faces: ArrayLike | None = None,
        contents: bytes | str | None = None,
        file_type: str | None = None,
    ) -> None:
        """Describe a mesh; see MeshShape. With ``vertices`` there must be ``faces``."""
        if vertices is not None and faces is None and path is None and contents is None:
            raise InvalidShapeError("Mesh: vertices come with faces; Convex takes points alone")
        super().__init__(
            path, scale, vertices=vertices, faces=faces, contents=contents, file_type=file_type
        )
