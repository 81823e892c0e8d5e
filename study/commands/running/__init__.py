"""The part of `nanoslip run` that the root process does: an `Order` is carried out on a farm of processes."""
