"""A node that hands out handles of its scene: to whom, how often, and where no token is seen."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_values
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.serialization import serialize_message
from recordings import replay

from scene_graph_msgs.msg import SourceHandle, Status
from scene_graph_ros.replay.reader import RecordingReader

SCENE = """version: 1
sources: [{name: cups, claim: first}, {name: bowls, token_file: bowls.token}, {name: plates}]
frames: [{name: cup, source: cups}, {name: bowl, source: bowls}]
"""


def test_handles_go_to_whom_the_scene_says_and_nowhere_else(client, start_node, domain, tmp_path):
    """The log and diagnostics say that it was claimed; a replay comes to the same world."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    bag = tmp_path / "bag"
    parameters = {"record": bag, "allow_editing": False, "diagnostics_rate": 20.0}
    node = start_node({"scene": tmp_path / "scene.yaml", **parameters})
    heard = client.listen(DiagnosticArray, "/diagnostics")
    assert client.call("RegisterSource", name="cups").status.code == Status.UNAVAILABLE
    heard.wait_for(
        lambda m: diagnostics_values(m, "world").get("sources that the first may claim") == "cups",
        "what may be claimed",
    )
    allow = Parameter(name="allow_editing", value=ParameterValue(type=1, bool_value=True))
    request = SetParameters.Request(parameters=[allow])
    client.call_any(SetParameters, "/scene_graph/set_parameters", request)
    cups = client.call("RegisterSource", name="cups").source
    assert client.call("RegisterSource", name="cups").status.code == Status.NAME_CONFLICT
    assert client.call("RegisterSource", name="plates").status.code == Status.NAME_CONFLICT
    bowls = SourceHandle(name="bowls", token=int((tmp_path / "bowls.token").read_text()))
    for handle, frame in ((cups, "cup"), (bowls, "bowl")):
        answer = client.call("RemoveFrame", source=handle, frames=[frame])
        assert answer.status.code == Status.OK, answer.status.message
    heard.wait_for(
        lambda m: diagnostics_values(m, "world").get("sources claimed") == "cups", "who claimed"
    )
    listed = client.call_any(
        ListParameters, "/scene_graph/list_parameters", ListParameters.Request()
    )
    names = listed.result.names
    values = client.call_any(
        GetParameters, "/scene_graph/get_parameters", GetParameters.Request(names=names)
    )
    assert len(values.values) == len(names) > 50
    assert node.stop() == 0
    assert "source 'cups' is claimed" in node.output()
    seen = node.output().encode() + serialize_message(values)
    seen += b"".join(serialize_message(m) for m in heard.kept())
    seen += b"".join(message.data for message in RecordingReader(bag))
    for handle in (cups, bowls):
        assert str(handle.token).encode() not in seen
        assert handle.token.to_bytes(8, "little") not in seen
    (tmp_path / "bowls.token").unlink()
    code, said = replay(domain, bag, "--check")
    assert code == 0, said
    assert not (tmp_path / "bowls.token").exists()
