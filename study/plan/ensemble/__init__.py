"""Ensembles that get members until they know enough: which tasks wait for that, and how many members that will take."""
