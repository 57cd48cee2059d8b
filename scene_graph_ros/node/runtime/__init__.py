"""What the rest of the node runs on: threads, topics, names, parameters, the process's end."""
