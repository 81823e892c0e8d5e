"""Kinds of task, one file each: when a campaign needs it, how it is keyed, what it needs, how it runs, what it yields."""
