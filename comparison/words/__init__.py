"""Sentences about results: the only place that makes them, of numbers that other rooms found."""
