"""Where things are: the scene graph, its contexts and the inspector."""
