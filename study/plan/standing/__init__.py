"""Progress of a plan: outcomes of its cases and drives, and which tasks are finished or left."""
