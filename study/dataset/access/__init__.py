"""Access to a dataset: one case, all of its events, several datasets joined into one, flat tables."""
