"""Cross-validation of the two models of the press: scenes, runs, comparison, verdict and report."""
