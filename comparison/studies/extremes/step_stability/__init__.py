"""Stability of steps: Baumgarte's gains under an explicit method, and contacts under fixed steps."""
