"""Whether the press is chaotic, as the paper says: answered with both models."""
