"""Clearance at the crank pin as well as in the guide."""
