"""Tasks: what one is, and one file for each kind of task, in the order of stages."""
