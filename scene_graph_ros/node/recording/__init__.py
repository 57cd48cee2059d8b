"""Recordings of a node's inputs and outputs; imported where the parameter asks for one."""
