"""The wall behind which programs are solved: what leaves it is proven, or says that it is not."""
