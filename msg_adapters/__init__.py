"""Messages to core types and back: pure functions that know no node.

Each module holds one kind of thing and converts it in both directions: ``x_from_msg`` validates
a message from outside and returns core types, ``x_to_msg`` returns messages whose numbers are
plain Python numbers or arrays of the field's type, since other numbers leave as garbage.
"""
