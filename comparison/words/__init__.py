"""Sentences about results. Only this package makes sentences; the numbers are of other packages."""
