"""Both models as distributions, where single runs cannot be predicted."""
