"""Simulation engines: built-in and installed models, their platform and source hashes."""
