"""What several examples share: pictures, processes' ends, a client that plans."""
