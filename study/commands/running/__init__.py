"""What `nanoslip run` does on the root: asked for as an order, conducted on a farm."""
