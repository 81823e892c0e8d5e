"""What accuracy costs in time: work-precision diagrams of every numerical knob (`nanoslip accuracy`)."""
