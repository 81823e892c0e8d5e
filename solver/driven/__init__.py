"""A driven pin that is pulled over its contact itself, which remembers the way it went."""
