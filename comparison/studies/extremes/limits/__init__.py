"""Limits with a known answer, and the orders at which both models converge to them."""
