"""Reliability with random inputs: how their scatter changes the errors of the slider."""
