"""Convex regions of configurations that are proven free, and their certificates.

Searches and their results are public in `scene_graph_ros.planning`. Their planes, multipliers,
programs and further options are public here. Names are imported when they are first used.
"""

import importlib
from typing import Any, TYPE_CHECKING

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

_MODULES = {
    "lagrangians": ("AffineFunction", "Lagrangian", "SeparatingPlaneLagrangians"),
    "search_options": (
        "FindPolytopeGivenLagrangianOptions",
        "FindSeparationCertificateGivenPolytopeOptions",
        "FindSeparationCertificateOptions",
    ),
    "separating_planes": (
        "CIrisCollisionGeometry",
        "CIrisGeometryType",
        "CSpaceSeparatingPlane",
        "PlaneSide",
        "SeparatingPlaneOrder",
    ),
    "separation_certificate_program": ("SeparationCertificateProgram",),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]
