"""Real inputs scatter: what that does to the errors of the slider."""

from comparison.studies.random_inputs.study import write

__all__ = ["write"]
