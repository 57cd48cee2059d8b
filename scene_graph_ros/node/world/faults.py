"""Reasons why a message, or a part of it, is not applied; and those that a topic can have."""

from __future__ import annotations

import enum

__all__ = [
    "CONFIGURATION_FAULTS",
    "HEIGHT_FAULTS",
    "IMAGE_FAULTS",
    "INFO_FAULTS",
    "POINT_FAULTS",
    "POSE_FAULTS",
    "VOXEL_FAULTS",
    "Fault",
]


class Fault(enum.Enum):
    """Why a pose, or a whole message, was not applied."""

    MALFORMED = "malformed"
    STALE = "stale"
    FUTURE = "future"
    OUT_OF_ORDER = "out_of_order"
    NOT_FINITE = "not_finite"
    NOT_UNIT = "not_unit"
    UNKNOWN_FRAME = "unknown_frame"
    WRONG_SOURCE = "wrong_source"
    WRONG_PARENT = "wrong_parent"
    CONTRADICTORY = "contradictory"
    UNKNOWN_GEOMETRY = "unknown_geometry"
    WRONG_LENGTH = "wrong_length"
    TOO_LARGE = "too_large"
    NO_POSES = "no_poses"
    NO_CAMERA_INFO = "no_camera_info"


_OF_IMAGES = {Fault.NO_POSES, Fault.NO_CAMERA_INFO}
_OF_NO_POSES = {Fault.UNKNOWN_GEOMETRY, Fault.WRONG_LENGTH, Fault.TOO_LARGE, *_OF_IMAGES}
_OF_NO_CONFIGURATIONS = {
    Fault.NOT_UNIT,
    Fault.UNKNOWN_FRAME,
    Fault.CONTRADICTORY,
    Fault.TOO_LARGE,
    *_OF_IMAGES,
}
POSE_FAULTS = tuple(fault for fault in Fault if fault not in _OF_NO_POSES)
CONFIGURATION_FAULTS = tuple(fault for fault in Fault if fault not in _OF_NO_CONFIGURATIONS)
POINT_FAULTS = (
    Fault.MALFORMED,
    Fault.STALE,
    Fault.FUTURE,
    Fault.OUT_OF_ORDER,
    Fault.UNKNOWN_FRAME,
    Fault.UNKNOWN_GEOMETRY,
    Fault.TOO_LARGE,
    Fault.NO_POSES,
)
IMAGE_FAULTS = (*POINT_FAULTS, Fault.WRONG_LENGTH, Fault.NO_CAMERA_INFO)
HEIGHT_FAULTS = (
    Fault.MALFORMED,
    Fault.STALE,
    Fault.FUTURE,
    Fault.OUT_OF_ORDER,
    Fault.NOT_FINITE,
    Fault.UNKNOWN_GEOMETRY,
    Fault.WRONG_LENGTH,
)
VOXEL_FAULTS = (
    Fault.MALFORMED,
    Fault.STALE,
    Fault.FUTURE,
    Fault.OUT_OF_ORDER,
    Fault.UNKNOWN_FRAME,
    Fault.UNKNOWN_GEOMETRY,
    Fault.WRONG_LENGTH,
    Fault.TOO_LARGE,
)
INFO_FAULTS = (Fault.MALFORMED, Fault.TOO_LARGE)
