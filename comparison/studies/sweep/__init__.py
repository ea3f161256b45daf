"""Runs over any keys of a scene: a table with one row a run."""
