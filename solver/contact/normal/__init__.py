"""Contact sets found from the matrix of the surface's compliance, before any node slips."""
