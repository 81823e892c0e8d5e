"""Results on disk, and the labelled dataset that is made of them."""
