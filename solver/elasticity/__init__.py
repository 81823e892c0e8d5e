"""The elastic slab, from its grid to its surface (§2.1.2-2.1.4). Knows nothing of pins and friction."""
