"""Both models at the extremes of their parameters: results of the runs, and outcomes that none may have."""
