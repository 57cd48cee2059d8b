"""Which pairs might touch: bounding boxes and the search among them."""
