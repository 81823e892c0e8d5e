"""Logs of results: one behind the other in each, and where each of them is."""
