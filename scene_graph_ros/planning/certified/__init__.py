"""Convex regions of configurations that are proven free, and their certificates.

Searches and their results are public in `scene_graph_ros.planning`. Their planes, multipliers,
programs and further options are public here. Names are imported when they are first used.
"""

from typing import TYPE_CHECKING

from scene_graph_ros.lazy_names import lazy_names

if TYPE_CHECKING:
    from scene_graph_ros.planning.certified.lagrangians import (
        AffineFunction,
        Lagrangian,
        SeparatingPlaneLagrangians,
    )
    from scene_graph_ros.planning.certified.search_options import (
        FindPolytopeGivenLagrangianOptions,
        FindSeparationCertificateGivenPolytopeOptions,
        FindSeparationCertificateOptions,
    )
    from scene_graph_ros.planning.certified.separating_planes import (
        CIrisCollisionGeometry,
        CIrisGeometryType,
        CSpaceSeparatingPlane,
        PlaneSide,
        SeparatingPlaneOrder,
    )
    from scene_graph_ros.planning.certified.separation_certificate_program import (
        SeparationCertificateProgram,
    )

__all__ = [
    "AffineFunction",
    "CIrisCollisionGeometry",
    "CIrisGeometryType",
    "CSpaceSeparatingPlane",
    "FindPolytopeGivenLagrangianOptions",
    "FindSeparationCertificateGivenPolytopeOptions",
    "FindSeparationCertificateOptions",
    "Lagrangian",
    "PlaneSide",
    "SeparatingPlaneLagrangians",
    "SeparatingPlaneOrder",
    "SeparationCertificateProgram",
]

__getattr__, __dir__ = lazy_names(__name__)
