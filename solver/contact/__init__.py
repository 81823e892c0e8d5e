"""A rigid pin on the slab under a given load (§2.1.1, §3.1): who touches, who sticks, which forces act."""
