"""Places of fields by the rules of CDR, compared with the serializer's bytes."""

from __future__ import annotations

import inspect
from types import SimpleNamespace

from geometry_msgs.msg import PoseStamped, TransformStamped
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, JointState, MultiDOFJointState, PointCloud2
from std_msgs.msg import Empty
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.wire.layout import HEADER, Layout, layout
import scene_graph_msgs.msg
import scene_graph_msgs.srv

KINDS = [
    PoseStamped,
    TransformStamped,
    CameraInfo,
    JointState,
    MultiDOFJointState,
    PointCloud2,
    Empty,
    Marker,
    MarkerArray,
    *(kind for _, kind in inspect.getmembers(scene_graph_msgs.msg, inspect.isclass)),
    *(
        kind.Request
        for _, kind in inspect.getmembers(scene_graph_msgs.srv, inspect.isclass)
        if hasattr(kind, "Request")
    ),
]
NUMBERS = {"float": "<f4", "double": "<f8", "boolean": "?", "octet": "<u1", "char": "<u1"}


def filled(kind, rng, depth=0):
    """Return a message of random contents: sequences of 0 to 3, strings of 0 to 8 bytes."""
    message = kind()
    for name, slot in zip(kind.get_fields_and_field_types(), kind.SLOT_TYPES, strict=True):
        setattr(message, name, value_of(getattr(message, name), slot, rng, depth))
    return message


def value_of(default, slot, rng, depth):
    """Return a random value of a field's type."""
    if hasattr(slot, "value_type"):
        most = min(getattr(slot, "maximum_size", 3), 3 if depth < 3 else 0)
        count = len(default) if hasattr(slot, "size") else int(rng.integers(most + 1))
        inner = slot.value_type
        if hasattr(inner, "typename") and inner.typename == "octet":
            return [bytes([int(rng.integers(256))]) for _ in range(count)]
        kind = class_of(inner)
        return [value_of(kind() if kind else None, inner, rng, depth + 1) for _ in range(count)]
    if hasattr(slot, "namespaced_name"):
        return filled(type(default), rng, depth + 1)
    if not hasattr(slot, "typename"):
        return "".join(rng.choice(list("aß→"), int(rng.integers(4))))
    if slot.typename == "boolean":
        return bool(rng.integers(2))
    if slot.typename == "octet":
        return bytes([int(rng.integers(256))])
    dtype = np.dtype(NUMBERS.get(slot.typename, slot.typename))
    value = rng.integers(1, 100)
    return float(value) if dtype.kind == "f" else int(value)


def class_of(slot):
    """Return the class of messages that a type names, None for other types."""
    if not hasattr(slot, "namespaced_name"):
        return None
    package, folder, name = slot.namespaced_name()
    module = __import__(f"{package}.{folder}", fromlist=[name])
    return getattr(module, name)


def leaves(message, prefix=""):
    """Yield the path and the bytes of each field that is no message, without CDR's lengths."""
    for name, slot in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
        value, path = getattr(message, name), prefix + name
        if hasattr(slot, "value_type"):
            inner = slot.value_type
            if hasattr(inner, "typename"):
                yield path, raw(value, inner.typename)
            elif hasattr(inner, "namespaced_name"):
                for each in value:
                    yield from leaves(each, f"{path}.")
            else:
                for each in value:
                    yield path, each.encode() + b"\0"
        elif hasattr(slot, "namespaced_name"):
            yield from leaves(value, f"{path}.")
        elif hasattr(slot, "typename"):
            yield path, raw([value], slot.typename)
        else:
            yield path, value.encode() + b"\0"


def raw(values, typename):
    """Return numbers in a row, as bytes."""
    if typename == "octet":
        return b"".join(values)
    return np.array(values, dtype=NUMBERS.get(typename, typename)).tobytes()


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_each_field_is_where_the_serializer_puts_it(kind):
    """Contents of all lengths: each field's bytes are its value, in order; the rest is padding."""
    rng = np.random.default_rng(len(kind.__name__))
    for _ in range(8):
        message = filled(kind, rng)
        data, found = serialize_message(message), layout(message)
        texts = [field for field in found.fields if not field.path.endswith("[]")]
        expected = list(leaves(message)) or [(field.path, b"\0") for field in texts]
        assert [(f.path, data[f.begin : f.end]) for f in texts] == expected
        assert 0 <= len(data) - found.size < 8 * (1 + str(message).count("[]"))
        scrambled = np.frombuffer(data, np.uint8).copy()
        padding = found.is_padding()
        padding[:HEADER] = False
        scrambled[: found.size][padding] ^= 0xFF
        assert deserialize_message(scrambled.tobytes(), kind) == deserialize_message(data, kind)


def test_lengths_of_sequences_are_fields():
    """They are before their elements, and aligned for themselves."""
    message = JointState(name=["a", "bc"], position=[1.0])
    found, data = layout(message), serialize_message(message)
    for path, length in (("name[]", 2), ("position[]", 1), ("effort[]", 0)):
        # The name of the sequence; strings in it have lengths of their own.
        begin = found.begins(path)[0]
        assert int.from_bytes(data[begin : begin + 4], "little") == length


def test_a_message_within_another_begins_elsewhere():
    """As it would behind other fields."""
    whole, inner = layout(PoseStamped()), layout(PoseStamped().pose, 17)
    assert inner.begin("position.x") == whole.begin("pose.position.x") == 20
    assert inner.size - inner.begin("position.x") == 56


def test_a_field_that_is_not_there_is_an_error():
    """Nothing is written to a place of another field."""
    with pytest.raises(ValueError, match="unpack"):
        layout(JointState()).begin("speed")
    assert Layout([]).size == HEADER


def test_a_type_that_no_definition_has_is_named():
    """Sixteen bytes have no rule here."""
    wide = SimpleNamespace(typename="long double")
    kind = type("Odd", (), {"x": 0.0})
    kind.get_fields_and_field_types = classmethod(lambda cls: {"x": "long double"})
    kind.SLOT_TYPES = (wide,)
    with pytest.raises(TypeError, match="have no place in a message"):
        layout(kind())
