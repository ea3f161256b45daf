"""Both models at the extremes of their parameters: what comes out, and what never does."""
