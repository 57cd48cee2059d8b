"""Our own renderer: depth and label exact, object by object, colour of visible surfaces."""
