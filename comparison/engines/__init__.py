"""Who can simulate a scene: our models and installed ones, on which machine, from which sources."""
