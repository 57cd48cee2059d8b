"""A view of the world in a browser: `server.BrowserView` serves a page and the motion on it."""
