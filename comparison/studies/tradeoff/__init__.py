"""Speed against accuracy: every formulation and integrator over its settings, its cost and its error."""
