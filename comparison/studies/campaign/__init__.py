"""Differential campaign: random scenes through both models, and who errs where they differ."""
