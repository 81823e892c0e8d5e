"""Influence of each effect, measured on random scenes; and a test of the tolerance within which effects are left out."""
