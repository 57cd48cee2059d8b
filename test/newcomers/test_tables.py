"""Result tables as people read them: names, rows, HTML, and a DataFrame of what was asked for."""

import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import QueryArgumentError


@pytest.fixture
def query():
    """Balls of radius 1 at x = 0, 1.5, 3, ...: neighbours are 0.5 deep in each other."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("<row>")
    poses = {}
    for k in range(30):
        frame = scene_graph.register_frame(source, GeometryFrame(f"f{k}"))
        ball = scene_graph.register_geometry(
            source, frame, GeometryInstance(np.eye(4), Sphere(1.0), "ball")
        )
        scene_graph.assign_role(source, ball, ProximityProperties())
        poses[frame] = np.eye(4)
        poses[frame][0, 3] = 1.5 * k
    context = scene_graph.create_default_context()
    context.set_frame_poses(source, poses)
    return scene_graph.query_object(context)


def test_print_shows_names_and_rows(query):
    """Twenty rows, by the names that scene files give, and how many more there are."""
    lines = str(query.compute_point_pair_penetration()).splitlines()
    assert lines[0] == "Penetrations: 29 rows"
    assert lines[1].split()[:3] == ["A", "B", "p_WCa"]
    # The deepest point of A in B is A's at x = 1, that of B at x = 0.5.
    assert lines[2].split()[:2] == ["<row>/f0/ball", "<row>/f1/ball"]
    assert "(1, 0, 0)" in lines[2]
    assert "(0.5, 0, 0)" in lines[2]
    assert lines[2].split()[-1] == "0.5"
    assert len(lines) == 2 + 20 + 1
    assert lines[-1] == "... and 9 more"
    assert str(query.find_collision_candidates()[:0]) == "CandidatePairs: 0 rows"


def test_html_has_the_same_and_no_markup_of_names(query):
    """A name is text, whatever is in it."""
    text = query.compute_point_pair_penetration()._repr_html_()
    assert text.count("<tr>") == 1 + 20
    assert "&lt;row&gt;/f0/ball" in text
    assert "<row>" not in text


def test_names_survive_slices_and_not_pickles(query):
    """A slice knows its scene, a copy in another process has ids."""
    table = query.compute_point_pair_penetration()
    assert "<row>/f28/ball" in str(table[-1:])
    copied = pickle.loads(pickle.dumps(table))
    assert f"GeometryId({table.id_A[0]})" in str(copied)


def test_points_and_slices_have_names(query):
    """A table about points has one geometry a row."""
    table = query.compute_signed_distance_to_points([[0.0, 0.0, 3.0]], 2.5)
    assert str(table).splitlines()[0] == "PointDistances: 2 rows"
    assert "<row>/f1/ball" in str(table)


def test_to_pandas_has_what_was_asked_for(query):
    """Names and the query's own columns; no column that is None."""
    table = query.compute_point_pair_penetration()
    frame = table.to_pandas()
    vectors = [f"{name}_{axis}" for name in ("p_WCa", "p_WCb", "nhat_BA_W") for axis in "xyz"]
    assert list(frame.columns) == ["name_A", "name_B", "id_A", "id_B", *vectors, "depth"]
    assert not frame.isna().to_numpy().any()
    assert frame["p_WCa_x"].tolist() == table.p_WCa[:, 0].tolist()
    few = table.to_pandas(["name_B", "depth"])
    assert list(few.columns) == ["name_B", "depth"]
    assert few["name_B"][0] == "<row>/f1/ball"
    jacobians = query.compute_point_pair_penetration(derivatives=True)
    assert jacobians.to_pandas(["dp_WCa_dX_WA"]).shape == (29, 18)
    with pytest.raises(QueryArgumentError, match="no column 'depht', but name_A, name_B, id_A"):
        table.to_pandas(["depht"])


def test_a_batch_of_poses_is_a_question(query):
    """`QueryObject.ask_what_if` answers of each pose, and moves nothing."""
    frame = query.inspector().get_all_frame_ids()[1]
    X_WF = np.tile(np.eye(4), (3, 1, 1))
    X_WF[:, 2, 3] = 0.0, 1.0, 5.0
    poses = [{frame: X} for X in X_WF]
    counts = query.ask_what_if(poses, lambda asked: len(asked.find_collision_candidates()))
    before = len(query.find_collision_candidates())
    assert counts == [before, before, before - 1]
