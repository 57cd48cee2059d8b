"""Values for the fields of messages, good for nothing but to be refused."""

from __future__ import annotations

import math
import random
from typing import Any

from fuzzing import BAD_NUMBERS, BAD_TEXTS
import numpy as np

__all__ = ["anything", "assert_finite", "fields"]

INTEGERS = (0, 1, 2, 3, 7, 8, 100, 255, -1, -(2**31), 2**31 - 1, 2**32 - 1, -(2**63), 2**63 - 1)
RANGES = {
    "boolean": (0, 1),
    "octet": (0, 255),
    "uint8": (0, 255),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}


def fields(message: Any, path: tuple[Any, ...] = ()) -> list[tuple[tuple[Any, ...], str]]:
    """Return where all fields of a message are, and their types."""
    found = []
    for name, kind in message.get_fields_and_field_types().items():
        value, place = getattr(message, name), (*path, name)
        found.append((place, kind))
        if hasattr(value, "get_fields_and_field_types"):
            found += fields(value, place)
        elif isinstance(value, list):
            for index, item in enumerate(value[:2]):
                if hasattr(item, "get_fields_and_field_types"):
                    found += fields(item, (*place, index))
    return found


def anything(rng: random.Random, kind: str) -> Any:
    """Return a value for a field of a type, None for a message, which stays as it is."""
    if kind.startswith("sequence<"):
        inner, _, bound = kind[len("sequence<") : -1].partition(", ")
        most = int(bound) if bound else rng.choice([0, 1, 2, 3, 7, 14, 100])
        items = [anything(rng, inner) for _ in range(rng.randint(0, most))]
        return None if None in items else items
    if kind.endswith("]"):
        inner, _, count = kind[:-1].partition("[")
        return [anything(rng, inner) for _ in range(int(count))]
    if kind == "string":
        known = ["base", "hand", "ball", "box", "floor", "table", "proximity", "mesh", "triangles"]
        known += ["eye", "depth", "points"]
        return rng.choice([*BAD_TEXTS, *known])
    if kind in ("double", "float"):
        return rng.choice(BAD_NUMBERS)
    if kind in RANGES:
        low, high = RANGES[kind]
        value = rng.choice([i for i in INTEGERS if low <= i <= high])
        return bool(value) if kind == "boolean" else value
    return None


def assert_finite(message: Any) -> None:
    """Fail for a number in a message that is none."""
    for name, kind in message.get_fields_and_field_types().items():
        value = getattr(message, name)
        if hasattr(value, "get_fields_and_field_types"):
            assert_finite(value)
        elif isinstance(value, list):
            for item in value:
                if hasattr(item, "get_fields_and_field_types"):
                    assert_finite(item)
        elif kind == "double":
            assert math.isfinite(value), (name, value)
        elif kind.startswith(("double[", "sequence<double")):
            assert np.isfinite(np.asarray(value, dtype=np.float64)).all(), (name, value)
