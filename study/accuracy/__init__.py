"""Time that accuracy costs: work-precision diagrams of every numerical setting (`nanoslip accuracy`)."""
