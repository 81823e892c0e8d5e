"""Planning: tasks, their costs and order."""
