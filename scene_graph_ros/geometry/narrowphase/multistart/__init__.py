"""Contacts from many starts, for what nothing proves."""
