"""Stability of steps: Baumgarte's gains under an explicit method, and contacts without error control."""
