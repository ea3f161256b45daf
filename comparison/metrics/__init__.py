"""Measures of how two results differ: arrays in, numbers out."""
