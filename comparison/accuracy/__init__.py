"""From settings to errors: levels of refinement, error bounds that were measured, tiers, uncertainty."""
