"""Geometry and parameters that the paper does not print but that its other figures imply."""
