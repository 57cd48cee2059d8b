"""The base of the node: threads, topics, names, parameters, the process's end."""
