"""Whether the press is chaotic, as the paper says: answered with both models."""

from comparison.studies.nonlinear.study import write

__all__ = ["write"]
