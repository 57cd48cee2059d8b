"""Origins of pages that the parameter lets in. A check of it need not import the server."""

from __future__ import annotations

import re

from scene_graph_ros.geometry.quoting import quoted

__all__ = ["origins_of"]

_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://[a-z0-9.:\[\]_-]*")


def origins_of(text: str) -> tuple[str, ...]:
    """Return the origins that a text separates by commas: ``https://app.foxglove.dev,file://``.

    Raises ValueError for one that is not as a browser sends it: a scheme, a host and perhaps a
    port, without a path. Nothing stands for all of them.
    """
    origins = tuple(part.strip().lower() for part in text.split(",") if part.strip())
    for origin in origins:
        if not _ORIGIN.fullmatch(origin):
            raise ValueError(
                f"{quoted(origin)} is no origin of a page, such as https://app.foxglove.dev"
            )
    return origins
