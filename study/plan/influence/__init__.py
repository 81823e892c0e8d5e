"""What a scene calls for: which effects can be left out of it within a tolerance, from influences that were measured."""
