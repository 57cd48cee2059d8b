"""A renderer that asks a server: the scene goes out as glTF by HTTP, and an image comes back."""
