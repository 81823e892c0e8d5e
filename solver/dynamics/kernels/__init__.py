"""Compiled integration of Eq. 12 with the friction of Eq. 13-14: closed forms from event to event, or Runge-Kutta steps."""
