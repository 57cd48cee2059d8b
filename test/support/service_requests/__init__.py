"""Good requests of the node's services, by what they are about, and what answers them."""
