"""A variable over the axes of a campaign: its points, which axis goes where, and the drawing."""
