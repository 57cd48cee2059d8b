"""What `make setup` runs: a virtual environment with ROS 2, the messages and compiled kernels.

Only the standard library is imported here, because nothing else is there yet.
"""
