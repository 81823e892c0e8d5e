"""Figures: views of a dataset, a variable over axes, frames of a case, and scripts beside campaigns."""
