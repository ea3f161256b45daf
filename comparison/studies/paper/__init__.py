"""The paper's figures and statements, one by one, against both models."""

from comparison.studies.paper.study import write

__all__ = ["write"]
