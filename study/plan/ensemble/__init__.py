"""Ensembles that grow until a target uncertainty is reached: which tasks wait for that, and how many members are expected."""
