"""Every command with its arguments and its help; what it does is in the file of its name, one folder up."""
