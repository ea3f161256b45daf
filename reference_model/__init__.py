"""The hand-written solver of the paper's equations."""

from reference_model.simulation import Result, simulate

__all__ = ["Result", "simulate"]
