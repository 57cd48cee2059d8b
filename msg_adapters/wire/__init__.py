"""Messages as bytes: what reads them and writes them without objects of messages."""
