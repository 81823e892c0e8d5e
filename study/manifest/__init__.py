"""Campaign files: reading, checking, and expanding them into cases."""
