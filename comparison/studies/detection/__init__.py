"""The gate's own test: false alarms, detected faults and the smallest change that is detected."""

from comparison.studies.detection.study import write

__all__ = ["write"]
