"""Accuracy: levels of refinement, measured error bounds, tiers, numerical uncertainty."""
