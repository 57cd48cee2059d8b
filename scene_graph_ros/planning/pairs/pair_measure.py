"""The distance of a pair by the address of its function: shapes alone, or clouds as well."""

from __future__ import annotations

import inspect

from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE

__all__ = ["measure_address", "pair_distance"]

_IS_COMPILED = not inspect.isfunction(PAIR_DISTANCE.call)

_UNCOMPILED_ELEMENTS = 1
"""Stands for an address where kernels are functions of Python, which have none."""


def measure_address(*, has_clouds: bool) -> int:
    """Return the address of PAIR_DISTANCE, or that of ELEMENT_DISTANCE."""
    if not has_clouds:
        return PAIR_DISTANCE.address()
    from scene_graph_ros.geometry.query.elements.pair_entry import ELEMENT_DISTANCE

    return ELEMENT_DISTANCE.address() if _IS_COMPILED else _UNCOMPILED_ELEMENTS


pair_distance = PAIR_DISTANCE.call
"""For kernels: what is at the address says of a pair, see PAIR_DISTANCE."""

if not _IS_COMPILED:

    def pair_distance(address, arguments):
        """Return the same where there are no addresses."""
        if address == _UNCOMPILED_ELEMENTS:
            from scene_graph_ros.geometry.query.elements.pair_entry import ELEMENT_DISTANCE

            return ELEMENT_DISTANCE.call(address, arguments)
        return PAIR_DISTANCE.call(address, arguments)
