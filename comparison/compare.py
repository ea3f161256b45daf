"""Comparison of two results; re-exports `comparison.verdict.compare`."""

from comparison.verdict.compare import Runs, compare

__all__ = ["Runs", "compare"]
