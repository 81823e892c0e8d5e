"""Compiled integration of Eq. 12 with the friction of a contact that is followed from event to event."""
