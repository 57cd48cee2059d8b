"""One array of numbers in every form that NumPy has for it, and what no form of it is."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["HUGE", "equal_forms", "no_numbers"]

HUGE = 10**400
"""An integer beyond all floats."""


class _Sub(np.ndarray):
    """An array of another class."""


def equal_forms(values: Any) -> dict[str, Any]:
    """Return an array of small whole numbers in every layout, byte order and type."""
    array = np.array(values, dtype=np.float64)
    strange = np.zeros((*array.shape[:-1], 2 * array.shape[-1] + 1))[..., 1::2]
    strange[...] = array
    room = np.frombuffer(bytearray(array.nbytes + 1), np.uint8)[1:]
    unaligned: NDArray[np.float64] = np.ndarray(array.shape, np.float64, room)
    unaligned[...] = array
    fixed = array.copy()
    fixed.setflags(write=False)
    forms = {
        "C": array,
        "Fortran": np.asfortranarray(array),
        "transposed": array.T.copy().T,
        "negative strides": array[::-1].copy()[::-1],
        "negative strides, last axis": array[..., ::-1].copy()[..., ::-1],
        "every second": strange,
        "unaligned": unaligned,
        "read-only": fixed,
        "read-only Fortran": np.asfortranarray(fixed),
        "subclass": array.view(_Sub),
        "masked array": np.ma.masked_array(array),
        "list": array.tolist(),
    }
    if array.ndim == 2:
        forms["matrix"] = np.matrix(array)
    kinds = ("f2", "f4", "g", ">f8", "<f8", ">f4", "i1", "i2", ">i4", "i8", "u1", "u8")
    return forms | {kind: array.astype(kind) for kind in kinds}


def no_numbers(values: Any) -> dict[str, Any]:
    """Return what has an array's shape, and no real numbers in it."""
    array = np.array(values, dtype=np.float64)
    objects = array.astype(object)
    objects.flat[0] = HUGE
    with_none = array.astype(object)
    with_none.flat[0] = None
    infinite = array.astype("g")
    infinite.flat[0] = np.longdouble("1e4000")
    return {
        "complex": array.astype(complex),
        "text": array.astype(str),
        "bytes": array.astype(bytes),
        "times": array.astype("m8[s]"),
        "huge integers": np.full(array.shape, HUGE, dtype=object).tolist(),
        "a huge integer": objects,
        "none": with_none,
        "beyond float64": infinite,
        "masked": np.ma.masked_array(array, mask=array == array.flat[0]),
        "records": np.zeros(array.shape, dtype=[("x", float)]),
        "zero size": array[:0],
        "nothing": [],
        "a mapping": {0: 1},
        "ragged": [array.tolist(), [1.0]],
    }
