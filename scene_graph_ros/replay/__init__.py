"""Replays recordings of the node: `python -m scene_graph_ros.replay BAG --check`."""
