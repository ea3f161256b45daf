"""Reliability of the slider against the ideal mechanism, as in the paper, with its uncertainty."""
