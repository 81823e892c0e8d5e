"""Figures of shipped campaigns: those of the paper, each beside a table of what the paper says and what is found."""
