"""``python -m scene_graph_ros.node``."""

from scene_graph_ros.node.main import main

main()
