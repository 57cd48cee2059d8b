"""Contacts from many starts, for pairs that nothing proves."""
