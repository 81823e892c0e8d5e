"""How event sizes are distributed: histograms, power laws and their rivals, correlations of successive events."""
