"""The elastic slab: grid, stiffness, surface compliance and interior fields (§2.1.2-2.1.4), without pin and friction."""
