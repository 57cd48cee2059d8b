"""One robot in one scene, as each engine knows it."""
