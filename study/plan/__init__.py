"""What there is to compute: tasks, what they cost, their order."""
