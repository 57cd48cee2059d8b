"""The one list of effects: the demand for each, its answer, its publisher, and its module.

The module is imported when the effect is first asked for. Reading this list imports neither
rclpy nor any effect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from scene_graph_ros.geometry import Role
from scene_graph_ros.node.effects.demand import (
    CLOUDS,
    count_clouds,
    count_compliant,
    count_deformable,
    count_role,
    Demand,
)
from scene_graph_ros.node.runtime.names import (
    CAMERAS,
    CONTACT_MARKERS,
    CONTACT_SURFACE_MARKERS,
    CONTACT_SURFACE_POINTS,
    CONTACTS,
    JOG_STATUS,
    JOG_VELOCITIES,
    MARKERS_ILLUSTRATION,
    MARKERS_PERCEPTION,
    MARKERS_PLAN,
    MARKERS_PROXIMITY,
    MARKERS_REGIONS,
    PLAN_HOLDS,
    REGIONS,
    SENSED,
)

if TYPE_CHECKING:
    from scene_graph_ros.geometry.perception import CameraDescription

__all__ = [
    "CAMERAS_SWITCH",
    "CAMERA_TOPICS",
    "EFFECTS",
    "EFFECT_NAMES",
    "SENSED_SWITCH",
    "AnswerDeclaration",
    "EffectDeclaration",
    "SensedSource",
    "camera_effect",
    "camera_topics",
    "sensed_effect",
]


@dataclass(frozen=True)
class AnswerDeclaration:
    """An effect's answer about snapshots, for itself and others to publish.

    ``question`` is ``module:class`` of its code. An answer that ``is_slow`` is computed beside the
    updates, and published late where a scene is fine.
    """

    name: str
    question: str
    is_slow: bool = False


@dataclass(frozen=True)
class EffectDeclaration:
    """One effect.

    ``asked_by`` returns a sentence about the demand for it, or "" where there is none;
    ``would_ask`` names a demand. ``factory`` is ``module:class`` of its publisher, ``answer``
    its answer; with neither it is answers to requests, which the services compute.
    ``needs`` names the answers, its own and others', that it publishes where they are there.
    ``kernels`` names the group of kernels that it needs beside the main job's: it is on when they
    are compiled; ``measures`` says that it asks about pairs of geometry, which needs those of
    clouds where a scene has some. ``argument``, if any, is passed to the class beside its host,
    and the effect is there as long as it is; ``switch`` is the name by which scene files switch it
    off, if not its own.
    """

    name: str
    asked_by: Callable[[Demand], str]
    would_ask: str
    topics: tuple[str, ...] = ()
    factory: str = ""
    kernels: str = ""
    argument: Any = None
    switch: str = ""
    answer: AnswerDeclaration | None = None
    needs: tuple[str, ...] = ()
    measures: bool = False

    @property
    def modules(self) -> tuple[str, ...]:
        """Its imports on demand, as ``module:class``."""
        question = "" if self.answer is None else self.answer.question
        return tuple(name for name in (question, self.factory) if name)

    def kernel_groups(self, demand: Demand) -> tuple[str, ...]:
        """Return the groups of kernels that it needs for a scene beside the main job's."""
        clouds = CLOUDS if self.measures and demand.count(count_clouds) else ""
        return tuple(group for group in (self.kernels, clouds) if group)


def _by_role(role: Role) -> Callable[[Demand], str]:
    def asked_by(demand: Demand) -> str:
        count = demand.count(count_role, role)
        noun = "geometry has" if count == 1 else "geometries have"
        return f"{count} {noun} the {role.name.lower()} role" if count else ""

    return asked_by


def _by_compliance(demand: Demand) -> str:
    count = demand.count(count_compliant)
    noun = "geometry is" if count == 1 else "geometries are"
    return f"{count} {noun} compliant by hydroelastic properties" if count else ""


def _by_deformable(demand: Demand) -> str:
    count = demand.count(count_deformable)
    noun = "geometry has" if count == 1 else "geometries have"
    return f"{count} deformable {noun} the proximity role" if count else ""


def _by_request(query: str) -> Callable[[Demand], str]:
    def asked_by(demand: Demand) -> str:
        count = demand.requests.get(query, 0)
        return f"{count} request{'' if count == 1 else 's'} so far" if count else ""

    return asked_by


def _by_plan(demand: Demand) -> str:
    count = demand.requests.get("plan", 0)
    return f"{count} path{'' if count == 1 else 's'} found so far" if count else ""


def _by_region(demand: Demand) -> str:
    count = demand.kept.get("regions", 0)
    return f"{count} region{' is' if count == 1 else 's are'} kept" if count else ""


def _by_browser(demand: Demand) -> str:
    return "the parameter browser is true" if demand.parameter("browser") else ""


def _by_jog(demand: Demand) -> str:
    return "the parameter jog names a robot" if demand.parameter("jog") else ""


def _by_record(demand: Demand) -> str:
    return "the parameter record names a folder" if demand.parameter("record") else ""


CAMERA_TOPICS: dict[str, tuple[str, ...]] = {
    "color": ("color/image", "color/image/compressed", "color/camera_info"),
    "depth": (
        "depth/image",
        "depth/image/compressedDepth",
        "depth/image_raw",
        "depth/image_raw/compressedDepth",
        "depth/camera_info",
    ),
    "label": ("label/image", "label/image/compressed", "label/table"),
    "points": ("points", "label/table"),
}
"""Below a camera's own name, by what scene files call its images; each has "pose", too."""

_PACKAGE = "scene_graph_ros.node.effects"

EFFECTS: tuple[EffectDeclaration, ...] = (
    EffectDeclaration(
        "contact_surfaces",
        _by_compliance,
        "a geometry whose proximity role has hydroelastic properties that are compliant",
        (CONTACTS, CONTACT_SURFACE_MARKERS, CONTACT_SURFACE_POINTS),
        f"{_PACKAGE}.contact_surfaces:ContactSurfacesEffect",
        "surfaces",
        measures=True,
        answer=AnswerDeclaration(
            "surfaces", f"{_PACKAGE}.contact_surfaces:ContactSurfaces", is_slow=True
        ),
        needs=("surfaces",),
    ),
    EffectDeclaration(
        "deformable_contact",
        _by_deformable,
        "a deformable geometry with the proximity role",
        (CONTACTS,),
        kernels="deformable",
        answer=AnswerDeclaration(
            "deformable contact", f"{_PACKAGE}.deformable_contact:DeformableContact"
        ),
    ),
    EffectDeclaration(
        "point_contact",
        _by_role(Role.PROXIMITY),
        "a geometry with the proximity role",
        (CONTACTS, CONTACT_MARKERS),
        f"{_PACKAGE}.point_contact:PointContact",
        measures=True,
        answer=AnswerDeclaration("penetrations", f"{_PACKAGE}.point_contact:Penetrations"),
        needs=("surfaces", "penetrations", "deformable contact"),
    ),
    EffectDeclaration(
        "illustration",
        _by_role(Role.ILLUSTRATION),
        "a geometry with the illustration role",
        (MARKERS_ILLUSTRATION,),
        f"{_PACKAGE}.markers:IllustrationMarkers",
    ),
    EffectDeclaration(
        "proximity",
        _by_role(Role.PROXIMITY),
        "a geometry with the proximity role",
        (MARKERS_PROXIMITY,),
        f"{_PACKAGE}.markers:ProximityMarkers",
    ),
    EffectDeclaration(
        "perception",
        _by_role(Role.PERCEPTION),
        "a geometry with the perception role",
        (MARKERS_PERCEPTION,),
        f"{_PACKAGE}.markers:PerceptionMarkers",
    ),
    EffectDeclaration(
        "browser",
        _by_browser,
        "the parameter browser, if true at start,",
        (),
        f"{_PACKAGE}.browser:Browser",
        needs=("surfaces",),
    ),
    EffectDeclaration(
        "record",
        _by_record,
        "the parameter record, if it names a folder at start,",
        (),
        f"{_PACKAGE}.record:Record",
    ),
    EffectDeclaration(
        "signed_distance",
        _by_request("signed_distance"),
        "a request to compute_signed_distance_pair or compute_signed_distance_pairwise",
    ),
    EffectDeclaration(
        "point_distance",
        _by_request("point_distance"),
        "a request to compute_signed_distance_to_point",
    ),
    EffectDeclaration(
        "plan",
        _by_plan,
        "a path that plan_path found",
        (MARKERS_PLAN, PLAN_HOLDS),
        f"{_PACKAGE}.plan:PlanEffect",
        "planning",
        measures=True,
    ),
    EffectDeclaration(
        "jog",
        _by_jog,
        "the parameter jog, if it names a robot or a group of one at start,",
        (JOG_VELOCITIES, JOG_STATUS),
        f"{_PACKAGE}.jog:Jog",
        "planning",
        measures=True,
    ),
    EffectDeclaration(
        "planning",
        _by_request("planning"),
        "a request to check configurations, edges or clearance, or a goal of plan_path",
    ),
    EffectDeclaration(
        "regions",
        _by_region,
        "a region that is kept, by a request to grow_region with a name or to load_regions,",
        (MARKERS_REGIONS, REGIONS),
        f"{_PACKAGE}.regions:RegionsEffect",
        "convex",
    ),
    EffectDeclaration(
        "region_requests",
        _by_request("region_requests"),
        "a request to grow, check, load, save or remove regions",
    ),
)

CAMERAS_SWITCH = "cameras"
"""Switches all cameras off."""

SENSED_SWITCH = "sensed_points"
"""Switches the points of all images off, as they are published."""

EFFECT_NAMES = (
    *(declaration.name for declaration in EFFECTS),
    CAMERAS_SWITCH,
    SENSED_SWITCH,
)
"""What scene files may switch off."""


def camera_effect(camera: CameraDescription) -> EffectDeclaration:
    """Return the effect of one camera."""
    name, frame = camera.name, camera.frame
    where = "the world" if frame == "world" else f"frame {camera.source}/{frame}"

    def asked_by(demand: Demand) -> str:
        if name not in demand.cameras:
            return ""
        sees = demand.count(count_role, Role.PERCEPTION)
        nothing = "" if sees else ", though nothing has the perception role, which it sees"
        return f"the scene has it on {where}{nothing}"

    return EffectDeclaration(
        f"camera {name}",
        asked_by,
        "a scene that has it",
        camera_topics(camera),
        f"{_PACKAGE}.camera:CameraEffect",
        "cameras",
        camera,
        CAMERAS_SWITCH,
    )


@dataclass(frozen=True)
class SensedSource:
    """A source that sends images of depth."""

    name: str


def sensed_effect(source: str) -> EffectDeclaration:
    """Return the effect of one source's images."""

    def asked_by(demand: Demand) -> str:
        return "the scene has it, with images of depth" if source in demand.imaging else ""

    return EffectDeclaration(
        f"sensed points {source}",
        asked_by,
        "a scene whose source sends images of depth",
        (f"{SENSED}/{source}",),
        f"{_PACKAGE}.sensed_points:SensedPoints",
        "sensing",
        SensedSource(source),
        SENSED_SWITCH,
    )


def camera_topics(camera: CameraDescription) -> tuple[str, ...]:
    """Return the names of the topics that a camera has."""
    topics = ["pose"]
    for output, names in CAMERA_TOPICS.items():
        topics += [name for name in names if output in camera.outputs and name not in topics]
    return tuple(f"{CAMERAS}/{camera.name}/{name}" for name in topics)
