"""Inference from a campaign: parameters that matter, and values that agree with measurements."""
