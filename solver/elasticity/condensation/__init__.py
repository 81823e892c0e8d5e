"""From the stiffness of a whole slab to the compliance of its surface."""
