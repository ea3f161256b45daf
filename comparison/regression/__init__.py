"""Regression gate: detects changes of a model since its baseline; does not compare the two models."""
