"""Nonlinear dynamics on arrays: exponents, the 0-1 test, sections; and a control with known answers."""
