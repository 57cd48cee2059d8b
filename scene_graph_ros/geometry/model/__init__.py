"""Where things are: the scene graph, its contexts and what can be asked without poses."""
