"""Kinds of events, and why a kernel stops: each named in this one place."""

from enum import IntEnum


class EventKind(IntEnum):
    """What happens to a node; the first three can trigger an event."""

    SLIP = 0
    RELEASE = 1
    TOUCH = 2
    NOTHING = 3
    """No event, or a cascade that no event triggers."""


class Stop(IntEnum):
    """Why a kernel returns. What it means to a user: `nanoslip.solver.contact.outcomes`."""

    DONE = 0
    """All that was asked for."""
    FULL = 1
    """No room for a further event."""
    INACCURATE = 2
    """The equilibrium residual is above its limit: the tableau is to be rebuilt."""
    SLIP_UNBOUNDED = 3
    """No distance lowers a node's shear to what a slip leaves, or a pivot is singular."""
    CASCADE_LIMIT = 4
    """More slips in one event than allowed."""
    CONTACT_LOST = 5
    """The last node in contact would have to be released."""
    NO_EVENT = 6
    """No step along the rate reaches a constraint."""
    EDGE_REACHED = 7
    """The edge of a punch has come upon a node."""
    WINDOW_TOO_NARROW = 8
    """A node near the end of the window has touched, or a rough pin could soon meet one beyond it: another is to be set up."""
    CONTACT_CYCLE = 9
    """Nodes touch and are released in turn."""
    OVERSHOT = 10
    """The smallest step exceeds the limits of friction by too much."""
    NOT_FINITE = 11
    """A force or displacement is not a number."""
    STEEP = 12
    """A node in contact is on too steep a flank of the pin."""
