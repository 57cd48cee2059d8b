"""Requests with nothing in them are answered or refused with a reason, by every service."""

import inspect

from scene_graph_msgs.msg import Status
import scene_graph_msgs.srv

_HANDLE = "scene_graph_msgs/SourceHandle"
_SERVICES = sorted(
    name
    for name, kind in inspect.getmembers(scene_graph_msgs.srv, inspect.isclass)
    if hasattr(kind, "Request") and not name.startswith("RemoveSource")
)


def test_every_service_answers_a_request_of_empty_lists(start_node, client):
    """With the handle of a source where one is asked for; none fails inside."""
    start_node()
    source = client.call("RegisterSource", name="empty").source
    for name in _SERVICES:
        kind = getattr(scene_graph_msgs.srv, name)
        fields = kind.Request.get_fields_and_field_types()
        answer = client.call(
            name, **({"source": source} if fields.get("source") == _HANDLE else {})
        )
        assert answer.status.code != Status.INTERNAL_ERROR, (name, answer.status)
    answer = client.call("RegisterDeformableGeometry", source=source)
    assert answer.status.code not in (Status.OK, Status.INTERNAL_ERROR)
    assert "geometries is empty" in answer.status.message
