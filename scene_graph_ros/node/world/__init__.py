"""What the node knows: the scene and its poses, what arrives of them, and edits of the scene."""
