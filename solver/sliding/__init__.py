"""The pin slides from event to event (§3.2): the friction record, its steady part, its statistics."""
