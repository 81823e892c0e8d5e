"""Results of tasks on disk, with checksums, and failed attempts."""
