"""Tasks over processes: who computes what, how far it is, what a signal does."""
