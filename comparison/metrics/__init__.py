"""Metrics of differences: pure functions on arrays and tables."""
