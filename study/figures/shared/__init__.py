"""What all figures share: a drawing surface, tables of claims, the paper's numbers, and the registry of figures."""
