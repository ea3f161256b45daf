"""Three contact laws on the same scenes, and where they differ."""
