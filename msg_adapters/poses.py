"""Poses: messages of geometry_msgs, sensor_msgs and tf2_msgs to and from ``(n, 4, 4)`` arrays.

Messages hold positions in metres and quaternions in the order x, y, z, w. A batch that comes from
outside is never refused as a whole because one pose in it is bad: bad ones are listed beside the
good ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import enum
import math
from typing import Any, NamedTuple

from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import Header

from msg_adapters.errors import MessageError
from msg_adapters.stamps import checked_stamp_from_msg, stamp_to_msg
from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.pose_kernels import FAR_AWAY, NOT_FINITE, NOT_UNIT, VALID
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses
from scene_graph_ros.geometry.spatial.quaternion_kernels import poses_from_components_kernel
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE, QUATERNION_NORM_DEFECT

__all__ = [
    "JointBatch",
    "PoseBatch",
    "PoseFault",
    "RefusedPose",
    "are_usable_joints",
    "header_to_msg",
    "joints_from_components",
    "joints_from_msg",
    "meant_name",
    "multi_dof_joint_state_to_msg",
    "pose_batch",
    "pose_from_msg",
    "pose_stamped_to_msg",
    "pose_to_msg",
    "poses_from_components",
    "poses_from_multi_dof_joint_state",
    "poses_from_pose_stamped",
    "poses_from_tf",
    "poses_from_transform_stamped",
    "poses_to_msg",
    "tf_to_msg",
    "transform_from_msg",
    "transform_stamped_to_msg",
    "transform_to_msg",
]


class PoseFault(enum.Enum):
    """Why a pose or a joint position in a message is refused."""

    NOT_FINITE = "not finite"
    NOT_UNIT_QUATERNION = "quaternion not of unit length"
    FAR_AWAY = "beyond the largest coordinate"
    CONTRADICTORY = "said twice, and not the same"


class RefusedPose(NamedTuple):
    """One pose or joint position of a message that is not used."""

    name: str
    fault: PoseFault
    message: str
    """One sentence with the name and the value."""


class PoseBatch(NamedTuple):
    """The poses of one message: entry i of each field is about one frame F with parent P."""

    names: tuple[str, ...]
    parents: tuple[str, ...]
    """The ``frame_id`` that the poses are expressed in, as the sender wrote it."""
    stamps_ns: NDArray[np.int64]
    X_PF: NDArray[np.float64]
    """``(n, 4, 4)``; only what is valid."""
    refused: tuple[RefusedPose, ...]


class JointBatch(NamedTuple):
    """The joint positions of one message."""

    names: tuple[str, ...]
    positions: NDArray[np.float64]
    """``(n,)`` in radians or metres; only what is finite."""
    stamp_ns: int
    refused: tuple[RefusedPose, ...]


_REASONS = {
    PoseFault.NOT_FINITE: "is not finite",
    PoseFault.FAR_AWAY: f"has a coordinate beyond {MAX_COORDINATE:g} m",
    PoseFault.NOT_UNIT_QUATERNION: (
        f"has a quaternion whose norm is off 1 by more than {QUATERNION_NORM_DEFECT:g}"
    ),
}


_FAULTS = {
    NOT_FINITE: PoseFault.NOT_FINITE,
    FAR_AWAY: PoseFault.FAR_AWAY,
    NOT_UNIT: PoseFault.NOT_UNIT_QUATERNION,
}


def _refuse(name: str, fault: PoseFault, value: NDArray[np.float64]) -> RefusedPose:
    return RefusedPose(name, fault, f"pose of {quoted(name)} {_REASONS[fault]}: {value.tolist()}")


def poses_from_components(
    components: NDArray[np.float64], names: Sequence[str]
) -> tuple[NDArray[np.bool_], NDArray[np.float64], tuple[RefusedPose, ...]]:
    """Judge rows of x, y, z, qx, qy, qz, qw; return (which are valid, their poses, the others).

    ``components`` is ``(n, 7)``. Quaternions within QUATERNION_NORM_DEFECT of unit length are
    normalized.
    """
    X, statuses = np.empty((len(components), 4, 4)), np.empty(len(components), dtype=np.int64)
    if poses_from_components_kernel(components, X, statuses) == len(X):
        return np.ones(len(X), dtype=bool), X, ()
    valid = statuses == VALID
    refused = [
        _refuse(names[row], _FAULTS[int(statuses[row])], components[row])
        for row in np.flatnonzero(~valid).tolist()
    ]
    return valid, X[valid], tuple(refused)


def pose_batch(
    names: Sequence[str],
    parents: Sequence[str],
    stamps_ns: Sequence[int] | NDArray[np.int64],
    components: Sequence[tuple[float, ...]] | NDArray[np.float64],
) -> PoseBatch:
    """Return the valid poses among rows of x, y, z, qx, qy, qz, qw, and the refused ones.

    Names are taken without a leading slash. A frame that comes twice with one stamp counts once
    where both say the same, else it is refused; with several stamps all count, the oldest first.
    """
    rows = np.array(components, dtype=np.float64).reshape(-1, 7)
    stamps = np.asarray(stamps_ns, dtype=np.int64)
    names, parents = _all_meant(names), _all_meant(parents)
    twice: list[RefusedPose] = []
    if len(set(names)) < len(names):
        names, parents, stamps, rows, twice = _once(names, parents, stamps, rows)
    valid, X_PF, refused = poses_from_components(rows, names)
    if not refused:
        return PoseBatch(names, parents, stamps, X_PF, tuple(twice))
    kept = np.flatnonzero(valid).tolist()
    return PoseBatch(
        tuple(names[i] for i in kept),
        tuple(parents[i] for i in kept),
        stamps[kept],
        X_PF,
        (*twice, *refused),
    )


def _all_meant(names: Sequence[str]) -> tuple[str, ...]:
    """Return names without leading slashes: the same object where none has one."""
    if isinstance(names, tuple) and not any(name.startswith("/") for name in names):
        return names
    return tuple(map(meant_name, names))


def _once(
    names: tuple[str, ...],
    parents: tuple[str, ...],
    stamps: NDArray[np.int64],
    rows: NDArray[np.float64],
) -> tuple[
    tuple[str, ...], tuple[str, ...], NDArray[np.int64], NDArray[np.float64], list[RefusedPose]
]:
    """Return the fields of a batch by stamp, each frame once at each, and the refused ones."""
    refused: list[RefusedPose] = []
    kept: list[int] = []
    for stamp in sorted(set(stamps.tolist())):
        here = np.flatnonzero(stamps == stamp).tolist()
        values = [(parents[i], rows[i].tolist()) for i in here]
        one, bad = _said_twice([names[i] for i in here], values, "pose of")
        kept += [here[i] for i in one]
        refused += bad
    chosen = tuple(names[i] for i in kept), tuple(parents[i] for i in kept)
    return (*chosen, stamps[kept], rows[kept], refused)


def _components(position: Point | Vector3, rotation: Quaternion) -> tuple[float, ...]:
    return (
        position.x, position.y, position.z,
        rotation.x, rotation.y, rotation.z, rotation.w,
    )  # fmt: skip


def meant_name(name: str) -> str:
    """Return a name without a leading slash, which older programs put before names of frames."""
    return name[1:] if name.startswith("/") else name


def _said_twice(
    names: Sequence[str], values: Sequence[Any], noun: str
) -> tuple[list[int], list[RefusedPose]]:
    """Return the entries that count where names repeat, and the refused names.

    Of entries that say the same of a name the first counts; none where they do not.
    """
    first: dict[str, int] = {}
    contradicted: dict[str, RefusedPose] = {}
    for i, (name, value) in enumerate(zip(names, values, strict=True)):
        known = first.setdefault(name, i)
        if value != values[known] and name not in contradicted:
            text = (
                f"{noun} {quoted(name)} is there twice, as {quoted(values[known])} and as"
                f" {quoted(value)}: one of them has to go"
            )
            contradicted[name] = RefusedPose(name, PoseFault.CONTRADICTORY, text)
    kept = [i for name, i in first.items() if name not in contradicted]
    return kept, list(contradicted.values())


def poses_from_multi_dof_joint_state(msg: MultiDOFJointState) -> PoseBatch:
    """Read the pose of each named frame in its parent.

    Raises MessageError where there are not as many transforms as names.
    """
    names, transforms = msg.joint_names, msg.transforms
    if len(names) != len(transforms):
        raise MessageError(f"{len(names)} joint_names, but {len(transforms)} transforms")
    components = [_components(t.translation, t.rotation) for t in transforms]
    count = len(names)
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    return pose_batch(names, [msg.header.frame_id] * count, [stamp_ns] * count, components)


def poses_from_pose_stamped(msg: PoseStamped, frame: str) -> PoseBatch:
    """Read the pose of the one frame, named ``frame``, that the sender moves."""
    components = [_components(msg.pose.position, msg.pose.orientation)]
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    return pose_batch([frame], [msg.header.frame_id], [stamp_ns], components)


def poses_from_transform_stamped(msg: TransformStamped) -> PoseBatch:
    """Read the pose of ``child_frame_id`` in ``header.frame_id``."""
    return _from_transforms([msg])


def poses_from_tf(msg: Any) -> PoseBatch:
    """Read all transforms of a ``tf2_msgs/TFMessage``, which may come from several senders."""
    return _from_transforms(msg.transforms)


def _from_transforms(transforms: Iterable[TransformStamped]) -> PoseBatch:
    transforms = list(transforms)
    return pose_batch(
        [t.child_frame_id for t in transforms],
        [t.header.frame_id for t in transforms],
        [checked_stamp_from_msg(t.header.stamp) for t in transforms],
        [_components(t.transform.translation, t.transform.rotation) for t in transforms],
    )


def joints_from_msg(msg: JointState) -> JointBatch:
    """Read named joint positions; velocities and efforts are not looked at.

    A name that comes twice with the same position counts once, with two it is refused. Raises
    MessageError where there are not as many positions as names.
    """
    if len(msg.name) != len(msg.position):
        raise MessageError(f"{len(msg.name)} names, but {len(msg.position)} positions")
    stamp_ns = checked_stamp_from_msg(msg.header.stamp)
    names = tuple(map(meant_name, msg.name))
    positions = np.array(msg.position, np.float64)
    if len(set(names)) == len(names):
        return joints_from_components(names, positions, stamp_ns)
    kept, refused = _said_twice(names, positions.tolist(), "joint")
    used = tuple(names[i] for i in kept)
    batch = joints_from_components(used, positions[kept], stamp_ns)
    return batch._replace(refused=(*refused, *batch.refused))


def joints_from_components(
    names: tuple[str, ...], positions: NDArray[np.float64], stamp_ns: int
) -> JointBatch:
    """Return the usable ones of joint positions ``(n,)``, rad or m, and the refused ones."""
    if are_usable_joints(positions):
        return JointBatch(names, positions, stamp_ns, ())
    refused, good = [], []
    for i, (name, number) in enumerate(zip(names, positions.tolist(), strict=True)):
        if abs(number) <= MAX_COORDINATE:
            good.append(i)
        else:
            fault = PoseFault.FAR_AWAY if math.isfinite(number) else PoseFault.NOT_FINITE
            text = f"position of joint {quoted(name)} is {fault.value}: {number}"
            refused.append(RefusedPose(name, fault, text))
    kept = tuple(names[i] for i in good)
    return JointBatch(kept, positions[good], stamp_ns, tuple(refused))


def are_usable_joints(positions: NDArray[np.float64]) -> bool:
    """Tell whether there is nothing against any joint position ``(n,)``, rad or m."""
    return all(abs(number) <= MAX_COORDINATE for number in positions.tolist())


def _one(position: Point | Vector3, rotation: Quaternion, name: str) -> NDArray[np.float64]:
    rows = np.array([_components(position, rotation)], dtype=np.float64)
    _, X, refused = poses_from_components(rows, [name])
    if refused:
        raise InvalidPoseError(refused[0].message)
    return X[0]


def pose_from_msg(pose: Pose, name: str) -> NDArray[np.float64]:
    """Return the ``(4, 4)`` pose; raises InvalidPoseError with ``name`` and the value."""
    return _one(pose.position, pose.orientation, name)


def transform_from_msg(transform: Transform, name: str) -> NDArray[np.float64]:
    """Return the ``(4, 4)`` pose; raises InvalidPoseError with ``name`` and the value."""
    return _one(transform.translation, transform.rotation, name)


def _split(X: NDArray[np.float64]) -> tuple[list[list[float]], list[list[float]]]:
    batch = np.asarray(X, dtype=np.float64).reshape(-1, 4, 4)
    return batch[:, :3, 3].tolist(), quaternions_from_poses(batch).tolist()


def _quaternion(q: Sequence[float]) -> Quaternion:
    return Quaternion(x=q[0], y=q[1], z=q[2], w=q[3])


def poses_to_msg(X: NDArray[np.float64]) -> list[Pose]:
    """Return a message for each of ``(n, 4, 4)`` poses, with w >= 0."""
    return [
        Pose(position=Point(x=p[0], y=p[1], z=p[2]), orientation=_quaternion(q))
        for p, q in zip(*_split(X), strict=True)
    ]


def pose_to_msg(X: NDArray[np.float64]) -> Pose:
    """Return the message of one ``(4, 4)`` pose."""
    return poses_to_msg(X)[0]


def _transforms_to_msg(X: NDArray[np.float64]) -> list[Transform]:
    return [
        Transform(translation=Vector3(x=p[0], y=p[1], z=p[2]), rotation=_quaternion(q))
        for p, q in zip(*_split(X), strict=True)
    ]


def transform_to_msg(X: NDArray[np.float64]) -> Transform:
    """Return the message of one ``(4, 4)`` pose."""
    return _transforms_to_msg(X)[0]


def header_to_msg(stamp_ns: int, frame_id: str) -> Header:
    """Return a header with a stamp in nanoseconds."""
    return Header(stamp=stamp_to_msg(stamp_ns), frame_id=frame_id)


def multi_dof_joint_state_to_msg(
    names: Sequence[str], X_PF: NDArray[np.float64], *, stamp_ns: int, frame_id: str
) -> MultiDOFJointState:
    """Return the pose message of a source: frame ``names[i]`` is at ``X_PF[i]``."""
    transforms = _transforms_to_msg(X_PF)
    if len(names) != len(transforms):
        raise ValueError(f"{len(names)} names for {len(transforms)} poses")
    return MultiDOFJointState(
        header=header_to_msg(stamp_ns, frame_id), joint_names=list(names), transforms=transforms
    )


def pose_stamped_to_msg(X_PF: NDArray[np.float64], *, stamp_ns: int, frame_id: str) -> PoseStamped:
    """Return the stamped message of one pose in ``frame_id``."""
    return PoseStamped(header=header_to_msg(stamp_ns, frame_id), pose=pose_to_msg(X_PF))


def transform_stamped_to_msg(
    X_PF: NDArray[np.float64], *, stamp_ns: int, frame_id: str, child_frame_id: str
) -> TransformStamped:
    """Return the stamped transform of ``child_frame_id`` in ``frame_id``."""
    return TransformStamped(
        header=header_to_msg(stamp_ns, frame_id),
        child_frame_id=child_frame_id,
        transform=transform_to_msg(X_PF),
    )


def tf_to_msg(
    names: Sequence[str], X_PF: NDArray[np.float64], *, stamp_ns: int, frame_id: str
) -> list[TransformStamped]:
    """Return the transforms of a ``TFMessage`` that places ``names`` in ``frame_id``."""
    header = header_to_msg(stamp_ns, frame_id)
    return [
        TransformStamped(header=header, child_frame_id=name, transform=transform)
        for name, transform in zip(names, _transforms_to_msg(X_PF), strict=True)
    ]
