"""What to draw of a scene, as plain data, and views that draw it. No messages, no ROS."""
