"""What `make workspace` runs: the project in its other home, a workspace that colcon builds."""
