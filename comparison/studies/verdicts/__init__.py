"""Verdicts of both models on every shipped scene, at two tiers."""
