"""What each grid costs and how wrong it is, and the choice of one."""
