"""A scene in a cell of a notebook: drawn by a browser, without a server."""

import html

from chromium import find_chromium, REMEDY, Tab
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    IllustrationProperties,
    make_phong_illustration_properties,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.views import notebook

PICTURE_SIZE = (900, 560)


def _scene():
    """A red ball, 5 cm deep in a blue box on a floor, and a frame that may be moved."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("desk")
    link = scene_graph.register_frame(source, GeometryFrame("ball"))
    for on, shape, height, name, color in (
        (link, Sphere(0.2), 0.0, "ball", (1.0, 0.1, 0.1, 1.0)),
        (None, Box(0.6, 0.6, 0.3), 0.15, "box", (0.1, 0.2, 1.0, 1.0)),
    ):
        X = np.eye(4)
        X[2, 3] = height
        instance = GeometryInstance(X, shape, name)
        instance.set_proximity_properties(ProximityProperties())
        instance.set_illustration_properties(make_phong_illustration_properties(color))
        if on is None:
            scene_graph.register_anchored_geometry(source, instance)
        else:
            scene_graph.register_geometry(source, on, instance)
    context = scene_graph.create_default_context()
    X = np.eye(4)
    X[2, 3] = 0.45
    context.set_frame_poses(source, {link: X})
    return scene_graph, scene_graph.query_object(context)


def test_a_cell_is_one_element_that_ends_itself():
    """No name of the scene ends it early, and there is nothing to be loaded from elsewhere."""
    scene_graph, query = _scene()
    text = query._repr_html_()
    assert text.startswith("<iframe srcdoc=")
    assert text.count("<") == text.count("</iframe>") + 1
    inside = html.unescape(text.split('"')[1])
    assert "http://" not in inside.replace("http://www.w3.org", "")
    assert scene_graph._repr_html_().startswith("<iframe")


def test_two_floors_have_no_contacts_and_are_drawn_all_the_same():
    """What has no answer is said below the picture."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("a")
    link = scene_graph.register_frame(source, GeometryFrame("f"))
    for register in (
        scene_graph.register_anchored_geometry,
        lambda owner, geometry: scene_graph.register_geometry(owner, link, geometry),
    ):
        floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
        floor.set_proximity_properties(ProximityProperties())
        floor.set_illustration_properties(IllustrationProperties())
        register(source, floor)
    text = scene_graph._repr_html_()
    assert text.startswith("<iframe")
    assert "<p>Contacts are left out: " in text


def test_a_scene_that_is_too_large_says_so(monkeypatch):
    """A notebook keeps each cell in its file."""
    monkeypatch.setattr(notebook, "LARGEST", 1000)
    text = _scene()[1]._repr_html_()
    assert text.startswith("<p>QueryObject(1 source, 1 frame, 2 geometries) is too large")


@pytest.mark.skipif(find_chromium() is None, reason=REMEDY)
def test_a_browser_draws_the_cell(tmp_path):
    """Both bodies are seen in their colours; the time line, which a still has not, is hidden."""
    file = tmp_path / "notebook.html"
    file.write_text(f"<!doctype html><p>Out[1]:</p>{_scene()[1]._repr_html_()}")
    tab = Tab(*PICTURE_SIZE)
    try:
        tab.open(file.as_uri())
        inside = "document.querySelector('iframe').contentDocument"
        there = "document.querySelector('iframe')?.contentDocument?.body"
        tab.wait_for(f"{there} && Number({there}.dataset.items) === 2")
        tab.wait_for(f"Number({inside}.body.dataset.pictures) >= 1")
        assert tab.value(f"{inside}.querySelector('#timeline').hidden")
        picture = tab.picture().astype(int)
    finally:
        tab.close()
    assert not tab.problems
    red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
    assert ((red > 120) & (green < 80) & (blue < 80)).sum() > 500
    assert ((blue > 90) & (red < 70) & (green < 90)).sum() > 500
