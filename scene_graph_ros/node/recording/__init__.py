"""Recordings of what a node takes in and puts out; imported where the parameter asks for one."""
