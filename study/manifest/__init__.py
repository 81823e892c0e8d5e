"""A campaign file: read, checked, expanded into cases."""
