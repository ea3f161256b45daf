"""Real inputs scatter: what that does to the errors of the slider."""
