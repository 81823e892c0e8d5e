"""Commands that compute a campaign and gather its results, here or on a cluster."""
