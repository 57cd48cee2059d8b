"""A scene as a cell of a notebook: the page of the view in a browser, without a server."""

from __future__ import annotations

import html

import numpy as np

from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.results import Penetrations
from scene_graph_ros.views.browser.page_file import PageFile
from scene_graph_ros.views.still import StillMoment

__all__ = ["LARGEST", "cell_html"]

LARGEST = 64 << 20
"""Characters of a cell: a notebook keeps each in its file."""
_HEIGHT = 480
"""Pixels."""
_NONE = {
    **dict.fromkeys(("id_A", "id_B"), np.empty(0, np.int64)),
    **dict.fromkeys(("p_WCa", "p_WCb", "nhat_BA_W"), np.empty((0, 3))),
    "depth": np.empty(0),
}
"""Columns without a row."""


def cell_html(query: QueryObject) -> str:
    """Return an element that shows the world of ``query`` at the moment, with its contacts.

    It can be turned, and clicked at, also where no kernel runs any more. Where the meshes of the
    scene are too large to be kept in a notebook, it says so.
    """
    notes: list[str] = []
    page = PageFile(lambda number, error: notes.append(f"Geometry {number} is left out: {error}"))
    moment = query.bake()
    try:
        points = moment.compute_point_pair_penetration()
    except UnsupportedPairError as error:
        notes.append(f"Contacts are left out: {error}")
        points = Penetrations(_NONE)
    page.add(StillMoment(moment, points), 0.0)
    text = page.html()
    if len(text) > LARGEST:
        return _paragraphs(
            f"{query!r} is too large to be drawn in a notebook: {len(text) >> 20} MB, of at most"
            f" {LARGEST >> 20}. A node shows it with its parameter browser."
        )
    return (
        f'<iframe srcdoc="{html.escape(text)}" title="{html.escape(repr(query))}"'
        f' style="width: 100%; height: {_HEIGHT}px; border: 0"></iframe>{_paragraphs(*notes)}'
    )


def _paragraphs(*texts: str) -> str:
    return "".join(f"<p>{html.escape(text)}</p>" for text in texts)
