"""Figures: views of a dataset, a variable over axes, frames of one case, and scripts beside campaigns."""
