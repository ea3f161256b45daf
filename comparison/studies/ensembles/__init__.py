"""Distributions of the motion in both models, where single runs cannot be predicted."""
