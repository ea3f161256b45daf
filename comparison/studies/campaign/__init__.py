"""Differential campaign: random scenes through both models, and who errs where they differ."""

from comparison.studies.campaign.study import write

__all__ = ["write"]
