"""How long queries take, ours and the peers', on the same scenes."""
