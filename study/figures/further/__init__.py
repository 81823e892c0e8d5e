"""Figures that go on from the paper: its findings on ensembles, what one record knows, the continuum limit."""
