"""The six-bar press in extended precision: a model for sixbar-crossval, from its page of equations alone."""

from truth_press.simulation import simulate

__all__ = ["simulate"]
