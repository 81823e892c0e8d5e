"""Views: the figures that the shape of a dataset calls for, each with the numbers that are drawn."""
