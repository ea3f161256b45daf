"""Refinement: a run at an accuracy that is estimated on its own scene, and the settings compared there."""
