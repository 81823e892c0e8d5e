"""How much each effect matters, measured on random scenes, and whether what was found from that keeps its promise."""
