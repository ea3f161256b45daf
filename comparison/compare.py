"""Comparison of two results; re-exports `comparison.verdict.compare`."""

from comparison.accuracy.uncertainty import Runs
from comparison.verdict.compare import compare

__all__ = ["Runs", "compare"]
