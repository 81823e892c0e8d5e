"""Measurements of a laboratory: files of columns with units, and the force of a pull, read without any campaign."""
