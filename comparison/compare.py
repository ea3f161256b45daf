"""Comparison of two results; re-exports `comparison.agreement.compare`."""

from comparison.agreement.compare import Runs, compare

__all__ = ["Runs", "compare"]
