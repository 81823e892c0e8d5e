"""Figures: what a dataset calls for, a variable over axes, one case at work, and those of the scripts beside campaigns."""
