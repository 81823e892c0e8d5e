"""Estimated cost of tasks: seconds on one core, bytes of memory."""
