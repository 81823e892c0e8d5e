"""Campaigns as jobs of a batch system: what a job computes, and the script that it is."""
