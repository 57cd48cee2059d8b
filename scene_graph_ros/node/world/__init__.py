"""The node's world: the scene and its poses, the messages about them, and edits of the scene."""
