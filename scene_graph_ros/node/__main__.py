"""``python -m scene_graph_ros.node``."""

import sys

from scene_graph_ros.node.main import main

sys.exit(main())
