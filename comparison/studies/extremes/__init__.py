"""Both models at the extremes of their parameters: what comes out of each run, and what never does."""

from comparison.studies.extremes.study import write

__all__ = ["write"]
