"""The paper's contact laws on the same scene, and where they differ."""
