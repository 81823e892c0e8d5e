"""Compiled core of contact: state, response of the slab, slips, contact changes, the cascade, the next event, loading."""
