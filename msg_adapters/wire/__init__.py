"""Messages as bytes: read and written without objects of messages."""
