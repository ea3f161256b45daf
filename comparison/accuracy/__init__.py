"""Accuracy: named settings, refinement, tiers, numerical uncertainty."""
