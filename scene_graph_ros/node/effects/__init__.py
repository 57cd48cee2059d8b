"""Effects: what the node can compute and publish, each only while something asks for it."""
