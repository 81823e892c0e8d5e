"""Compiled core of sliding: the loop from event to event, with the whole contact or with constant pressures."""
