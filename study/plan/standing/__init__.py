"""How far a plan is: how its cases and drives ended, what of it is finished and left."""
