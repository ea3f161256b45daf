"""Speed against accuracy: every way to run a scene over its settings, what each costs and what it gives."""

from comparison.studies.tradeoff.study import write

__all__ = ["write"]
