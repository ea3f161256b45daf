"""Reliability of the paper's cases by both models."""
