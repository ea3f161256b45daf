"""Sentences about results: the only place that writes them, from data to text."""
