"""Both models at the extremes of their parameters: what comes out of each run, and what never does."""
