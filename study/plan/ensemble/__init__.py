"""Ensembles that get members until they know enough: which tasks wait for that."""
