"""How a robot on legs moves its centre of mass above its footsteps."""
