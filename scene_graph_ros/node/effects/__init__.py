"""Effects: answers and messages of the node, each only while something asks for it."""
