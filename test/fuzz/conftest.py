"""Without ROS there are no messages and no services to try."""

import importlib.util
import os

os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")

HAS_ROS = importlib.util.find_spec("rclpy") is not None
collect_ignore = [] if HAS_ROS else ["test_messages.py", "test_services.py"]
