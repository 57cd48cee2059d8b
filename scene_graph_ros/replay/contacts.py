"""Contacts of a replay, computed again and compared with the recorded ones, bit for bit.

Compared are all values, floats by their bits. Between them the middleware leaves bytes of padding
as they were in memory, which say nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import struct
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from msg_adapters.wire.contacts import ContactWire
from scene_graph_msgs.msg import ContactArray
from scene_graph_ros.node.effects.declarations import EffectDeclaration, EFFECTS
from scene_graph_ros.node.effects.demand import Demand
from scene_graph_ros.node.effects.point_contact import contact_message
from scene_graph_ros.node.effects.state import load
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["SURFACES", "ContactCheck", "answer_of", "effects_on"]

SURFACES = "contact_surfaces"
_DEFORMABLE, _POINTS = "deformable_contact", "point_contact"


class ContactCheck:
    """Compares; counts equal and different contacts."""

    def __init__(self, world_frame: str, parameter: Callable[[str], Any]) -> None:
        """Compare messages that are in ``world_frame``, of a node with these parameters."""
        self._wire = ContactWire(world_frame, serialize_message)
        self._parameter = parameter
        self._found: tuple[int, list[bytes]] = (-1, [])
        self.equal = self.late = self.different = 0
        self.first_different = 0

    def compare(
        self, snapshot: WorldSnapshot, effects_off: frozenset[str], time: int, data: bytes
    ) -> None:
        """Compare the contacts of a snapshot with a recorded message.

        Contact surfaces that were late, or whose kernels were not compiled, went without: such a
        message is compared with the points alone, and counted as late.
        """
        if self._found[0] != snapshot.sequence:
            self._found = (snapshot.sequence, self._messages(snapshot, effects_off))
        for index, message in enumerate(self._found[1]):
            if message == data or _content(message) == _content(data):
                self.equal += 1
                self.late += index > 0
                return
        self.different += 1
        self.first_different = self.first_different or time

    def _messages(self, snapshot: WorldSnapshot, effects_off: frozenset[str]) -> list[bytes]:
        """Return the message, and those that say less where something is late."""
        on = effects_on(snapshot, effects_off, self._parameter)
        surfaces = [answer_of(on, SURFACES, snapshot), None] if SURFACES in on else [None]
        deforms = [answer_of(on, _DEFORMABLE, snapshot), None] if _DEFORMABLE in on else [None]
        messages = []
        for found in surfaces:
            for deformable in deforms:
                faces, points = (
                    (None, answer_of(on, _POINTS, snapshot)) if found is None else found
                )
                if points is not None:
                    message = contact_message(self._wire, snapshot, points, faces, deformable)
                    messages.append(bytes(message))
        return messages


def _content(data: bytes) -> bytes:
    """Return all that a message says, without padding."""
    return b"".join(_values(deserialize_message(data, ContactArray)))


def _values(value: Any) -> Iterator[bytes]:
    if hasattr(value, "get_fields_and_field_types"):
        for name in value.get_fields_and_field_types():
            yield from _values(getattr(value, name))
    elif isinstance(value, float):
        yield struct.pack("<d", value)
    elif hasattr(value, "tobytes"):
        yield struct.pack("<Q", len(value)) + value.tobytes()
    elif isinstance(value, (list, tuple)):
        yield struct.pack("<Q", len(value))
        for each in value:
            yield from _values(each)
    else:
        text = str(value).encode()
        yield struct.pack("<Q", len(text)) + text


def effects_on(
    snapshot: WorldSnapshot, effects_off: frozenset[str], parameter: Callable[[str], Any]
) -> Mapping[str, EffectDeclaration]:
    """Return the effects by name that compute something and that the scene asks for."""
    demand = Demand(snapshot.inspector, {}, snapshot.cameras, parameter)
    return {
        effect.name: effect
        for effect in EFFECTS
        if effect.answer is not None and effect.name not in effects_off
        if effect.asked_by(demand)
    }


def answer_of(on: Mapping[str, EffectDeclaration], name: str, snapshot: WorldSnapshot) -> Any:
    """Return the answer of an effect about a snapshot, None for one that is not on."""
    declaration = on.get(name)
    if declaration is None or declaration.answer is None:
        return None
    return load(declaration.answer.question)()(snapshot)
