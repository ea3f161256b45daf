"""The verdict on pairs of solvers of systems that have nothing to do with the press."""
