"""The engines that are compared, each used as its experienced users would from Python."""
