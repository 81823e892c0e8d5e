"""Pictures of the model at work: pressure, shear, slip and friction force of one case, event by event."""
