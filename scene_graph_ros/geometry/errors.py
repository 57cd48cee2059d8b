"""Exceptions of the geometry core.

Every message names the offending field and quotes its value. Each class also derives from the
built-in exception that a Python user would expect (``ValueError``, ``KeyError``).
"""

__all__ = [
    "DeformableError",
    "EngineError",
    "FilterHistoryError",
    "InvalidConfigurationError",
    "InvalidPoseError",
    "InvalidShapeError",
    "MeshError",
    "NameConflictError",
    "OwnershipError",
    "PropertyError",
    "QueryArgumentError",
    "RoleError",
    "SceneGraphError",
    "UnknownIdError",
    "UnsupportedPairError",
]


class SceneGraphError(Exception):
    """Base of every error that the geometry core raises for a caller's mistake."""


class _KeyLikeError(SceneGraphError, KeyError):
    """A ``KeyError`` whose text is printed as written, without the quotes ``KeyError`` adds."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class UnknownIdError(_KeyLikeError):
    """A source, frame, geometry or filter id that is not registered, or not of the right kind."""


class PropertyError(_KeyLikeError):
    """A geometry property or group that is missing, exists already, or has the wrong type."""


class NameConflictError(SceneGraphError, ValueError):
    """A name that is empty, or already taken in its scope."""


class OwnershipError(SceneGraphError, ValueError):
    """A source tried to change an object that another source registered."""


class InvalidPoseError(SceneGraphError, ValueError):
    """A pose that is not a finite rigid transform, or of the wrong shape."""


class InvalidConfigurationError(SceneGraphError, ValueError):
    """Vertex positions of a deformable geometry that are not finite, or not one per vertex."""


class DeformableError(SceneGraphError, ValueError):
    """A deformable geometry where only a rigid one will do, or the other way round."""


class InvalidShapeError(SceneGraphError, ValueError):
    """A shape parameter that is not finite, not positive or out of range."""


class MeshError(SceneGraphError, ValueError):
    """A mesh that cannot be read, or whose data does not describe a surface."""


class RoleError(SceneGraphError, ValueError):
    """A role that is assigned twice, missing, or refused by the rules of roles."""


class QueryArgumentError(SceneGraphError, ValueError):
    """An argument of a query that is not a number, not finite or of the wrong shape."""


class EngineError(SceneGraphError, ValueError):
    """An engine that is not installed, or has no such query."""


class FilterHistoryError(SceneGraphError, ValueError):
    """A persistent collision filter declaration while transient ones are in force."""


class UnsupportedPairError(SceneGraphError, ValueError):
    """A query that has no answer for a pair of shapes."""
