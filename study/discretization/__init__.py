"""Time and error of each discretization of the slab, and the choice of one for a campaign."""
